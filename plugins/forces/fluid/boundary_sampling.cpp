#include "boundary_sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <string>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/math/elementary.h"

namespace sim {
namespace {

constexpr int kMostPushes = 100;      // of a point of a mesh, until it is deep enough
constexpr double kDeepEnough = 0.98;  // of the depth asked for
constexpr double kOnSurface = 1e-9;   // of the depth: points nearer are on the surface
constexpr double kSame = 0.5;         // of the width: nearer points are one
constexpr double kWidestShape = 300;  // widths, a shape: for the memory of its points

[[noreturn]] void refuse(const RigidShape& shape, const std::string& why,
                         const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"body of force 'fluid'", "",
                                  "its " + std::string(shape.name()) + " is " + why, remedy});
}

[[noreturn]] void refuse_thin(const RigidShape& shape, double depth) {
  refuse(shape, "not thicker than " + brief(2 * depth, 3) + " m everywhere",
         "make it thicker, or the particles of the fluid smaller");
}

void check_size(const RigidShape& shape, double width) {
  double widest = 2 * std::max(shape.half.maxCoeff(), shape.radius + 0.5 * shape.length);
  for (const Vec3& point : shape.points)
    widest = std::max(widest, (point - shape.points.front()).norm());
  if (!(widest <= kWidestShape * width))
    refuse(shape, brief(widest / width, 3) + " times as wide as particles of the fluid are apart",
           "give up to " + brief(kWidestShape, 4) + " times that");
}

int steps(double length, double width) {
  return std::max(1, static_cast<int>(std::ceil(length / width - 1e-9)));
}

std::vector<Vec3> under_box(const Vec3& half, double width) {
  int count[3];
  for (std::size_t k = 0; k < 3; ++k) count[k] = steps(2 * half[k], width);
  std::vector<Vec3> points;
  for (int i = 0; i <= count[0]; ++i)
    for (int j = 0; j <= count[1]; ++j)
      for (int k = 0; k <= count[2]; ++k) {
        if (i % count[0] && j % count[1] && k % count[2]) continue;
        const double at[3] = {1.0 * i / count[0], 1.0 * j / count[1], 1.0 * k / count[2]};
        Vec3& point = points.emplace_back();
        for (std::size_t axis = 0; axis < 3; ++axis) point[axis] = (2 * at[axis] - 1) * half[axis];
      }
  return points;
}

// Rings about y; each begins at another angle, so that points of neighbouring rings are not
// aligned.
std::vector<Vec3> under_round(double radius, double length, double width) {
  constexpr double kTurn = 0.61803398874989485;
  const double displacement = std::numbers::pi * radius + length,
               quarter = 0.5 * std::numbers::pi * radius;
  const int rings = std::max(2, steps(displacement, width));
  std::vector<Vec3> points;
  for (int ring = 0; ring <= rings; ++ring) {
    const double from_pole = displacement * std::min(ring, rings - ring) / rings;
    const auto [sine, cosine] =
        sine_cosine(std::min(from_pole, quarter) / (2 * std::numbers::pi * radius));
    double y = 0.5 * length + radius * cosine - std::max(0.0, from_pole - quarter);
    if (2 * ring > rings) y = -y;
    const double across = radius * sine;
    const int count = steps(2 * std::numbers::pi * across, width);
    for (int k = 0; k < count; ++k) {
      const auto [s, c] = sine_cosine(kTurn * ring + 1.0 * k / count);
      points.emplace_back(across * c, y, across * s);
    }
  }
  return points;
}

// The point of a triangle nearest to p: inside, or on the edges (Ericson (2005), Real-Time
// Collision Detection, section 5.1.5).
Vec3 nearest_on(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto on_edge = [&](const Vec3& from, const Vec3& to) {
    const Vec3 d = to - from;
    return from + std::clamp((p - from).dot(d) / d.squaredNorm(), 0.0, 1.0) * d;
  };
  const Vec3 normal = (b - a).cross(c - a);
  const auto inside = [&](const Vec3& from, const Vec3& to) {
    return normal.cross(to - from).dot(p - from) >= 0;
  };
  if (inside(a, b) && inside(b, c) && inside(c, a))
    return p - (p - a).dot(normal) / normal.squaredNorm() * normal;
  Vec3 best = on_edge(a, b);
  for (const Vec3& other : {on_edge(b, c), on_edge(c, a)})
    if ((other - p).squaredNorm() < (best - p).squaredNorm()) best = other;
  return best;
}

// A set of points with a least distance: a point near an earlier one is refused.
class Apart {
 public:
  explicit Apart(double least) : least_(least) {}

  bool add(const Vec3& p) {
    const auto [x, y, z] = cell(p);
    for (int i = x - 1; i <= x + 1; ++i)
      for (int j = y - 1; j <= y + 1; ++j)
        for (int k = z - 1; k <= z + 1; ++k) {
          const auto found = cells_.find({i, j, k});
          if (found == cells_.end()) continue;
          for (const Vec3& other : found->second)
            if ((other - p).squaredNorm() < least_ * least_) return false;
        }
    cells_[{x, y, z}].push_back(p);
    return true;
  }

 private:
  std::array<int, 3> cell(const Vec3& p) const {
    return {static_cast<int>(std::floor(p[0] / least_)),
            static_cast<int>(std::floor(p[1] / least_)),
            static_cast<int>(std::floor(p[2] / least_))};
  }

  double least_;
  std::map<std::array<int, 3>, std::vector<Vec3>> cells_;
};

// Points of the triangles, each pushed away from the nearest part of the surface until all of it is
// `depth` away: from an edge onto the line where the planes below intersect.
std::vector<Vec3> under_mesh(const RigidShape& mesh, double depth, double width) {
  const auto corner = [&](const std::array<int, 3>& t, std::size_t k) {
    return mesh.points[static_cast<std::size_t>(t[k])];
  };
  Apart above(kSame * width), below(kSame * width);
  std::vector<Vec3> points;
  const auto push = [&](Vec3 p) {
    for (int round = 0; round < kMostPushes; ++round) {
      double least = HUGE_VAL;
      Vec3 nearest, inwards;
      for (const auto& t : mesh.triangles) {
        const Vec3 a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
        const Vec3 on = nearest_on(p, a, b, c);
        if (const double far = (p - on).squaredNorm(); far < least)
          least = far, nearest = on, inwards = (c - a).cross(b - a);
      }
      least = std::sqrt(least);
      const bool inside = is_within(mesh, p);
      if (inside && least >= kDeepEnough * depth) {
        if (below.add(p)) points.push_back(p);
        return;
      }
      if (least > kOnSurface * depth) inwards = inside ? p - nearest : nearest - p;
      p = nearest + depth / inwards.norm() * inwards;
    }
    refuse_thin(mesh, depth);
  };
  for (const auto& t : mesh.triangles) {
    const Vec3 a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    if (!((b - a).cross(c - a).norm() > 0)) continue;
    const int n = steps(std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}), width);
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const Vec3 p = a + 1.0 * i / n * (b - a) + 1.0 * j / n * (c - a);
        if (above.add(p)) push(p);
      }
  }
  return points;
}

// True if x is more than `depth` below the surface of a part; of a mesh, if it is within.
bool is_below(RigidShape part, double depth, const Vec3& x) {
  part.radius -= (1 + kOnSurface) * depth;
  part.half -= Vec3::Constant((1 + kOnSurface) * depth);
  return is_within(part, in_part(part, x));
}

// Points under each part that are not as deep in another one.
std::vector<Vec3> under_parts(const RigidShape& compound, double depth, double width) {
  Apart apart(kSame * width);
  std::vector<Vec3> points;
  each_part(compound, [&](const RigidShape& part, const Vec3& at, const Mat3& axes) {
    for (const Vec3& local : sample_boundary(part, depth, width)) {
      const Vec3 x = at + axes * local;
      const bool covered = std::ranges::any_of(compound.parts, [&](const RigidShape& other) {
        return &other != &part && is_below(other, depth, x);
      });
      if (!covered && apart.add(x)) points.push_back(x);
    }
  });
  return points;
}

}  // namespace

double surface_area(const RigidShape& shape) {
  if (shape.form == RigidShape::Form::kCompound)
    return std::accumulate(
        shape.parts.begin(), shape.parts.end(), 0.0,
        [](double sum, const RigidShape& part) { return sum + surface_area(part); });
  const double r = shape.radius;
  const Vec3& h = shape.half;
  if (shape.is_round())
    return 4 * std::numbers::pi * r * r + 2 * std::numbers::pi * r * shape.length;
  double sum = 8 * (h[0] * h[1] + h[1] * h[2] + h[2] * h[0]);
  for (const auto& t : shape.triangles) {
    const Vec3& a = shape.points[static_cast<std::size_t>(t[0])];
    const Vec3& b = shape.points[static_cast<std::size_t>(t[1])];
    const Vec3& c = shape.points[static_cast<std::size_t>(t[2])];
    sum += 0.5 * (b - a).cross(c - a).norm();
  }
  return sum;
}

std::vector<Vec3> sample_boundary(const RigidShape& shape, double depth, double width) {
  if (shape.form == RigidShape::Form::kCompound) return under_parts(shape, depth, width);
  check_size(shape, width);
  switch (shape.form) {
    case RigidShape::Form::kBox:
      if (!(std::ranges::min(shape.half) > depth)) refuse_thin(shape, depth);
      return under_box(shape.half - Vec3::Constant(depth), width);
    case RigidShape::Form::kSphere:
    case RigidShape::Form::kCapsule:
      if (!(shape.radius > depth)) refuse_thin(shape, depth);
      return under_round(shape.radius - depth, shape.length, width);
    default:
      return under_mesh(shape, depth, width);
  }
}

}  // namespace sim
