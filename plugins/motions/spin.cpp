// Turning about its center.
#include "core/geometry/rigid_motion.h"
#include "core/math/elementary.h"
#include "core/plugin/periodic.h"
#include "core/plugin/plugin.h"

namespace {

class Spin final : public sim::RigidMotion {
 public:
  explicit Spin(const sim::Params& params)
      : period_(params, "motion 'spin'"), axis_(sim::axis_of(params, "motion 'spin'")) {}

  sim::Pose at(double t, const sim::Vec3& center) const override {
    const auto [sine, cosine] = sim::sine_cosine(period_.turns(t));
    return {
        .center = center, .axis = axis_, .sine = sine, .cosine = cosine, .rate = period_.rate()};
  }
  double max_angular_speed() const override { return std::fabs(period_.rate()); }

 private:
  sim::Period period_;
  sim::Vec3 axis_;
};

}  // namespace

SIM_PLUGIN(RigidMotion, "spin") {
  registrar.add(sim::Plugin<sim::RigidMotion>{
      {.name = "spin",
       .summary = "turning about its center",
       .formula = "by the angle 2 pi t / period + phase about the axis, right-handed",
       .params = sim::periodic_params({sim::axis_param()})},
      [](const sim::Params& params) { return std::make_unique<Spin>(params); }});
}
