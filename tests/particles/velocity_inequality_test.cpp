// The nearest velocity within half-spaces, against its closed forms.
#include "core/particles/velocity_inequality.h"

#include <catch2/catch.hpp>
#include <random>

using sim::Vec3;
using sim::VelocityInequality;

namespace {

VelocityInequality within(std::initializer_list<sim::HalfSpace> planes) {
  VelocityInequality bound;
  for (const sim::HalfSpace& plane : planes) bound.planes[bound.count++] = plane;
  return bound;
}

}  // namespace

TEST_CASE("the nearest velocity that planes allow is a projection") {
  const Vec3 v(1, -9.81, 2);
  CHECK((VelocityInequality().nearest(v) - v).norm() == 0);
  // A floor: the part into it goes. One that rises takes v along.
  CHECK((within({{{0, 1, 0}, 0}}).nearest(v) - Vec3(1, 0, 2)).norm() < 1e-15);
  CHECK((within({{{0, 1, 0}, 0.5}}).nearest(v) - Vec3(1, 0.5, 2)).norm() < 1e-15);
  CHECK((within({{{0, 1, 0}, -20}}).nearest(v) - v).norm() == 0);
  // An edge of two, one of which is not met; a corner of three.
  CHECK((within({{{0, 1, 0}, 0}, {{-1, 0, 0}, 0}}).nearest(v) - Vec3(0, 0, 2)).norm() < 1e-15);
  CHECK((within({{{0, 1, 0}, 0}, {{1, 0, 0}, 0}}).nearest(v) - Vec3(1, 0, 2)).norm() < 1e-15);
  CHECK((within({{{0, 1, 0}, 0}, {{-1, 0, 0}, 0}, {{0, 0, -1}, 0}}).nearest(v)).norm() < 1e-15);
}

// n_k.(x - v) sizes: x = v + sum s_k n_k with s_k >= 0, where a plane with s_k > 0 is met, and no
// plane is left: Kuhn and Tucker's conditions, which only the nearest point meets.
TEST_CASE("the nearest velocity meets the conditions of Kuhn and Tucker, however planes lie") {
  std::mt19937 dice(1);
  std::normal_distribution<double> normal;
  const auto some = [&] { return Vec3(normal(dice), normal(dice), normal(dice)); };
  for (int trial = 0; trial < 2000; ++trial) {
    VelocityInequality bound;
    const int count = 1 + trial % 3;
    for (int k = 0; k < count; ++k) {
      const Vec3 n = some();
      bound.planes[bound.count++] = {n / n.norm(), normal(dice)};
    }
    const Vec3 v = some(), x = bound.nearest(v);
    // Any allowed y is on the far side of x: (y - x).(x - v) >= 0.
    for (int k = 0; k < count; ++k)
      CHECK(bound.planes[k].normal.dot(x) >= bound.planes[k].least - 1e-9);
    for (int other = 0; other < 20; ++other) {
      const Vec3 y = x + some();
      bool allowed = true;
      for (int k = 0; k < count; ++k)
        allowed = allowed && bound.planes[k].normal.dot(y) >= bound.planes[k].least;
      if (allowed) CHECK((y - x).dot(x - v) >= -1e-9 * (1 + v.norm()));
    }
  }
}
