// Friction that is larger at rest than in motion, which causes stick-slip.
#include "core/math/elementary.h"
#include "core/particles/contact_law.h"
#include "core/plugin/plugin.h"
#include "core/plugin/surface_params.h"

namespace {

class Stribeck final : public sim::ContactLaw {
 public:
  explicit Stribeck(const sim::Params& params)
      : rests_(params.number("static")),
        slides_(params.number("kinetic")),
        speed_(params.number("speed")),
        restitution_(params.number("restitution")) {
    if (!(speed_ > 0))
      throw sim::Error(sim::ErrorKind::kScene,
                       {"law 'stribeck'", "", "its speed is 0", "give a velocity > 0 in m/s"});
    if (slides_ > rests_)
      throw sim::Error(sim::ErrorKind::kScene,
                       {"law 'stribeck'", "", "its kinetic friction is larger than its static one",
                        "give kinetic <= static"});
  }

  double restitution(double /*approach*/) const override { return restitution_; }
  double friction(double speed) const override {
    return slides_ + (rests_ - slides_) * sim::damping(1, speed / speed_).keep;
  }
  bool constant() const override { return rests_ == slides_; }

 private:
  double rests_, slides_, speed_, restitution_;
};

}  // namespace

SIM_PLUGIN(ContactLaw, "stribeck") {
  registrar.add(sim::Plugin<sim::ContactLaw>{
      {.name = "stribeck",
       .summary = "static friction that falls to kinetic friction as the slip gets faster",
       .formula = "mu(w) = kinetic + (static - kinetic) e^(-w / speed),  v_n' = -restitution v_n\n"
                  "w: speed of the slip; at rest the static coefficient holds",
       .source = "Bo & Pavelescu (1982), The friction-speed relation and its influence on the "
                 "critical velocity of stick-slip motion, Wear 82(3), 277-289, with the exponent 1",
       .params = {{.name = "static", .doc = "coefficient at rest", .required = true, .min = 0},
                  {.name = "kinetic",
                   .doc = "coefficient of a fast slip, at most the static one",
                   .required = true,
                   .min = 0},
                  {.name = "speed",
                   .default_value = 0.01,
                   .unit = "m/s",
                   .doc = "> 0: slip at which the difference has fallen to 37 %",
                   .min = 0},
                  sim::restitution_param()},
       .example = {{"static", 0.6}, {"kinetic", 0.4}}},
      [](const sim::Params& params) { return std::make_unique<Stribeck>(params); }});
}
