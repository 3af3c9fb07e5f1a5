// A motion of space that fits the prescribed points.
#include "plugins/contact/surfaces/kinematic_fit.h"

#include <catch2/catch.hpp>
#include <cmath>

using sim::KinematicFit;
using sim::Vec3;

TEST_CASE("what is led passes through its ways, and all space moves with ends that turn") {
  const auto turned = [](const Vec3& p, double angle, double along) {
    const double c = std::cos(angle), s = std::sin(angle);
    return Vec3(p.x() + along, c * p.y() - s * p.z(), s * p.y() + c * p.z()) - p;
  };
  // A line that turns about an axis across it: distances between any two points of its plane, and
  // across it, change by one factor.
  KinematicFit line;
  for (int i = 0; i < 9; ++i) {
    const Vec3 p(0.5, 0, 0.1 * i - 0.3);
    line.add(p, turned(p, 0.7, -0.1));
  }
  const Vec3 places[] = {{0.5, 0, 0.11}, {0.5, 0.2, 0.1}, {0.52, -0.1, 0.3}, {2, 0.1, -4}};
  for (const Vec3& p : places) {
    const Vec3 displacement = line.at(p);
    CHECK(displacement.y() == Approx(turned(p, 0.7, -0.1).y()).margin(1e-5));
    CHECK(displacement.z() == Approx(turned(p, 0.7, -0.1).z()).margin(1e-5));
  }
  // Two of them, against each other: each is followed near it, and the ways of both are met.
  KinematicFit both;
  for (const double x : {-0.5, 0.5})
    for (int i = 0; i < 9; ++i) {
      const Vec3 p(x, 0, 0.1 * i - 0.4);
      both.add(p, turned(p, 0.2 * x, -0.1 * x));
    }
  const Vec3 on(-0.5, 0, 0.3), near(0.501, 0.001, 0.25);
  CHECK((both.at(on) - turned(on, -0.1, 0.05)).norm() < 1e-9);
  CHECK((both.at(near) - turned(near, 0.1, -0.05)).norm() < 1e-3);
  CHECK((both.at({0, 0, 0}) - Vec3::Zero()).norm() < 1e-12);
  CHECK(KinematicFit{}.at({1, 2, 3}) == Vec3::Zero());
}
