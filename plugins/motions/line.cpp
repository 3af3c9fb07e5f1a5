// Straight on at one velocity.
#include "core/geometry/rigid_motion.h"
#include "core/plugin/plugin.h"

namespace {

class Line final : public sim::RigidMotion {
 public:
  explicit Line(const sim::Params& params) : velocity_(params.vector("velocity")) {}
  sim::Pose at(double t, const sim::Vec3& center) const override {
    return {.center = center + t * velocity_, .velocity = velocity_};
  }
  double max_speed() const override { return velocity_.norm(); }

 private:
  sim::Vec3 velocity_;
};

}  // namespace

SIM_PLUGIN(RigidMotion, "line") {
  registrar.add(sim::Plugin<sim::RigidMotion>{
      {.name = "line",
       .summary = "straight on at one velocity",
       .formula = "center(t) = center + t velocity",
       .params = {{.name = "velocity",
                   .type = sim::ParamType::kVector,
                   .unit = "m/s",
                   .doc = "velocity",
                   .required = true}}},
      [](const sim::Params& params) { return std::make_unique<Line>(params); }});
}
