// Restitution of viscoelastic spheres, which is larger for slow impacts than for fast ones.
#include "core/math/elementary.h"
#include "core/particles/contact_law.h"
#include "core/plugin/plugin.h"
#include "core/plugin/surface_params.h"

namespace {

// The Pade approximant in u = beta^(1/2) v^(1/10) of the series that Hertz's force with the
// dissipation of Kuwabara & Kono has: 1 - 1.15345 u^2 + 0.79827 u^4 + ..., eq. 20 of the source.
double restitution_of(double u) {
  constexpr double c1 = 0.501086, b1 = 0.501086, b2 = 1.15345, b3 = 0.577977, b4 = 0.532178;
  return (1 + c1 * u) / (1 + u * (b1 + u * (b2 + u * (b3 + u * b4))));
}

class Viscoelastic final : public sim::ContactLaw {
 public:
  explicit Viscoelastic(const sim::Params& params)
      : speed_(params.number("speed")), friction_(params.number("friction")) {
    const double restitution = params.number("restitution");
    if (!(restitution > 0 && speed_ > 0))
      throw sim::Error(sim::ErrorKind::kScene,
                       {"law 'viscoelastic'", "", "its restitution or its speed is 0",
                        "give a restitution > 0 at a speed > 0 m/s"});
    // The u of that blow: restitution_of() falls from 1 on.
    double below = 0, above = 1;
    while (restitution_of(above) > restitution && above < 1e6) above *= 2;
    for (int halving = 0; halving < 100; ++halving) {
      const double middle = 0.5 * (below + above);
      (restitution_of(middle) > restitution ? below : above) = middle;
    }
    scale_ = below;
  }

  double restitution(double approach) const override {
    return approach > 0 ? restitution_of(scale_ * sim::power(approach / speed_, 0.1)) : 1;
  }
  double friction(double /*speed*/) const override { return friction_; }
  bool constant() const override { return scale_ == 0; }

 private:
  double speed_, friction_, scale_ = 0;
};

}  // namespace

SIM_PLUGIN(ContactLaw, "viscoelastic") {
  registrar.add(sim::Plugin<sim::ContactLaw>{
      {.name = "viscoelastic",
       .summary = "restitution that falls with the speed of the blow, as of viscoelastic spheres",
       .formula =
           "v_n' = -e(u) v_n,  u = u0 (v_n / speed)^(1/10),  e(u0) = restitution\n"
           "e(u) = (1 + c1 u) / (1 + b1 u + b2 u^2 + b3 u^3 + b4 u^4),  |p_t| <= friction p_n\n"
           "c1 = b1 = 0.501086, b2 = 1.15345, b3 = 0.577977, b4 = 0.532178",
       .source =
           "Mueller & Poeschel (2011), Collision of viscoelastic spheres: compact expressions "
           "for the coefficient of normal restitution, Phys. Rev. E 84, 021302, of Hertz's "
           "force with the dissipation of Kuwabara & Kono (1987), Jpn. J. Appl. Phys. 26, 1230",
       .params = {{.name = "restitution",
                   .doc = "share of the normal velocity that a blow at `speed` gives back",
                   .required = true,
                   .min = 0,
                   .max = 1},
                  {.name = "speed",
                   .default_value = 1.0,
                   .unit = "m/s",
                   .doc = "> 0: of the blow whose restitution is given",
                   .min = 0},
                  sim::friction_param()},
       .example = {{"restitution", 0.8}}},
      [](const sim::Params& params) { return std::make_unique<Viscoelastic>(params); }});
}
