// To and fro as a sine.
#include "core/geometry/rigid_motion.h"
#include "core/math/elementary.h"
#include "core/plugin/periodic.h"
#include "core/plugin/plugin.h"

namespace {

class Swing final : public sim::RigidMotion {
 public:
  explicit Swing(const sim::Params& params)
      : period_(params, "motion 'swing'"), amplitude_(params.vector("amplitude")) {}

  sim::Pose at(double t, const sim::Vec3& center) const override {
    const auto [sine, cosine] = sim::sine_cosine(period_.turns(t));
    return {.center = center + sine * amplitude_, .velocity = period_.rate() * cosine * amplitude_};
  }
  double max_speed() const override { return std::fabs(period_.rate()) * amplitude_.norm(); }

 private:
  sim::Period period_;
  sim::Vec3 amplitude_;
};

}  // namespace

SIM_PLUGIN(RigidMotion, "swing") {
  registrar.add(sim::Plugin<sim::RigidMotion>{
      {.name = "swing",
       .summary = "to and fro as a sine",
       .formula = "center(t) = center + amplitude sin(2 pi t / period + phase)",
       .params = sim::periodic_params({{.name = "amplitude",
                                        .type = sim::ParamType::kVector,
                                        .unit = "m",
                                        .doc = "how far to either side",
                                        .required = true}})},
      [](const sim::Params& params) { return std::make_unique<Swing>(params); }});
}
