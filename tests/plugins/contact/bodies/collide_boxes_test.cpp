// The narrow phase of boxes against projections of all their corners.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

#include "plugins/contact/bodies/collide_boxes.h"

namespace sim {
namespace {

struct RandomBox {
  explicit RandomBox(std::mt19937& random) {
    std::uniform_real_distribution<double> part(0, 1);
    std::normal_distribution<double> normal;
    for (std::size_t k = 0; k < 3; ++k) {
      shape.half[k] = 0.1 + part(random);
      center[k] = 2.4 * (part(random) - 0.5);
    }
    const auto direction = [&] {
      const Vec3 v(normal(random), normal(random), normal(random));
      return Vec3(v / v.norm());
    };
    const Vec3 x = direction(), across = direction().cross(x), y = across / across.norm();
    axes = transposed({x, y, x.cross(y)});
    shape.form = RigidShape::Form::kBox;
  }
  Placed placed() const { return {&shape, nullptr, center, axes}; }
  // The interval of its corners along n.
  std::pair<double, double> along(const Vec3& n) const {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int corner = 0; corner < 8; ++corner) {
      Vec3 x = center;
      for (std::size_t k = 0; k < 3; ++k)
        x += ((corner >> k) % 2 ? 1 : -1) * shape.half[k] * axes.column(k);
      low = std::min(low, n.dot(x)), high = std::max(high, n.dot(x));
    }
    return {low, high};
  }

  RigidShape shape;
  Vec3 center;
  Mat3 axes;
};

struct Separation {
  double gap = -HUGE_VAL;
  Vec3 normal;

  void look(const RandomBox& a, const RandomBox& b, const Vec3& axis) {
    const Vec3 n = axis / axis.norm();
    for (const Vec3& each : {n, Vec3(-n)})
      if (const double along = a.along(each).first - b.along(each).second; along > gap)
        gap = along, normal = each;
  }
};

TEST_CASE("boxes touch where no axis separates them, along the axis of largest separation",
          "[rigid]") {
  constexpr double kMargin = 0.1, kRounding = 1e-12;
  std::mt19937 random(7);
  int apart = 0, by_faces = 0, by_edges = 0;
  for (int k = 0; k < 3000; ++k) {
    const RandomBox a(random), b(random);
    Separation faces, edges;
    for (std::size_t i = 0; i < 3; ++i) {
      faces.look(a, b, a.axes.column(i));
      faces.look(a, b, b.axes.column(i));
      for (std::size_t j = 0; j < 3; ++j)
        edges.look(a, b, a.axes.column(i).cross(b.axes.column(j)));
    }
    std::vector<ManifoldPoint> points;
    collide_boxes(a.placed(), b.placed(), kMargin, points);
    INFO("pair " << k << ", separations " << faces.gap << ", " << edges.gap);
    const double gap = std::max(faces.gap, edges.gap);
    if (gap > kMargin) {
      CHECK(points.empty());
      ++apart;
      continue;
    }
    // A face is preferred to edges whose product is nearly its normal.
    if (points.empty()) {
      CHECK(gap > 0);
    } else if (gap == edges.gap && edges.normal.dot(faces.normal) <= kNearlyParallel) {
      CHECK(points.size() == 1);
      CHECK(points[0].gap == Approx(gap).margin(kRounding));
      CHECK((points[0].normal - edges.normal).norm() < kRounding);
      ++by_edges;
    } else if (gap == faces.gap) {
      CHECK(std::ranges::min(points, {}, &ManifoldPoint::gap).gap >= gap - kRounding);
      CHECK((points[0].normal - faces.normal).norm() < kRounding);
      ++by_faces;
    }
  }
  CHECK(apart > 300);
  CHECK(by_faces > 300);
  CHECK(by_edges > 300);
}

}  // namespace
}  // namespace sim
