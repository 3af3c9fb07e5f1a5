// Round in a circle, without turning.
#include "core/geometry/rigid_motion.h"
#include "core/math/elementary.h"
#include "core/plugin/periodic.h"
#include "core/plugin/plugin.h"

namespace {

class Orbit final : public sim::RigidMotion {
 public:
  explicit Orbit(const sim::Params& params) : period_(params, "motion 'orbit'") {
    const sim::Vec3 axis = sim::axis_of(params, "motion 'orbit'");
    const sim::Vec3 side = std::fabs(axis[0]) < 0.999 ? sim::Vec3(1, 0, 0) : sim::Vec3(0, 1, 0);
    across_ = params.number("radius") * (side - side.dot(axis) * axis).normalized();
    along_ = axis.cross(across_);
  }

  sim::Pose at(double t, const sim::Vec3& center) const override {
    const auto [sine, cosine] = sim::sine_cosine(period_.turns(t));
    return {.center = center + cosine * across_ + sine * along_,
            .velocity = period_.rate() * (cosine * along_ - sine * across_)};
  }
  double max_speed() const override { return std::fabs(period_.rate()) * across_.norm(); }

 private:
  sim::Period period_;
  sim::Vec3 across_, along_;
};

}  // namespace

SIM_PLUGIN(RigidMotion, "orbit") {
  registrar.add(sim::Plugin<sim::RigidMotion>{
      {.name = "orbit",
       .summary = "round its center in a circle, without turning",
       .formula =
           "center(t) = center + radius (e1 cos a + e2 sin a),  a = 2 pi t / period + phase\n"
           "e1: from the axis towards x (of an axis along x, towards y);  e2 = axis x e1",
       .params = sim::periodic_params(
           {{.name = "radius", .unit = "m", .doc = "of the circle", .required = true, .min = 0},
            sim::axis_param()})},
      [](const sim::Params& params) { return std::make_unique<Orbit>(params); }});
}
