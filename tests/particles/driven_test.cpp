// Prescribed vectors and their derivatives, and how often their motion is asked.
#include "core/particles/constraints/driven.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/particles/prescribed_motion.h"

using namespace sim;

namespace {

// A circle that counts; each of its poses counts five times, as where a velocity is had by
// differences.
class Counted final : public RigidMotion {
 public:
  Pose at(double t, const Vec3& center) const override {
    asked += 5;
    Pose pose;
    pose.center = center + place(t);
    pose.velocity = Vec3(-2 * std::sin(2 * t), 2 * std::cos(2 * t), 0);
    return pose;
  }
  Vec3 center_at(double t, const Vec3& center) const override {
    ++asked;
    return center + place(t);
  }

  mutable int asked = 0;

 private:
  static Vec3 place(double t) { return {std::cos(2 * t), std::sin(2 * t), 0}; }
};

}  // namespace

TEST_CASE("a driven vector and its derivatives are those of a circle, from nine places a moment") {
  const auto circle = std::make_shared<Counted>();
  const Driven driven(circle, {1, 2, 3}, {0, 0, 1});
  for (const double t : {0.7, 0.7, 0.8, 0.7}) {
    CAPTURE(t);
    const Driven::At at = driven.at(t);
    const Vec3 arm(std::cos(2 * t), std::sin(2 * t), 0);
    CHECK((at.x - Vec3(1, 2, 4) - arm).norm() < 1e-15);
    CHECK((at.v - 2 * Vec3(-arm.y(), arm.x(), 0)).norm() < 1e-11);
    CHECK((at.a + 4 * arm).norm() < 1e-9);
  }
  circle->asked = 0;
  driven.at(0.8);
  CHECK(circle->asked == 9);
  driven.at(0.8);  // the next Newton iteration of the same stage
  CHECK(circle->asked == 9);
  driven.place(0.8);
  CHECK(circle->asked == 10);
}

TEST_CASE("a prescribed particle asks its motion once a moment for its acceleration") {
  const auto circle = std::make_shared<Counted>();
  PrescribedMotion motion;
  motion.add(0, {1, 0, 0}, circle);
  double a[3][1] = {};
  circle->asked = 0;
  for (int stage = 0; stage < 2; ++stage) motion.accelerate(0.3, {a[0], a[1], a[2]});
  CHECK(circle->asked == 9);
  CHECK(std::fabs(a[0][0] + 4 * std::cos(0.6)) < 1e-9);
  CHECK(std::fabs(a[1][0] + 4 * std::sin(0.6)) < 1e-9);
}
