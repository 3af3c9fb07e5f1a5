// Coulomb's friction and Newton's restitution: the default law of colliders and bodies.
#include "core/particles/contact_law.h"
#include "core/plugin/plugin.h"
#include "core/plugin/surface_params.h"

namespace {

class Coulomb final : public sim::ContactLaw {
 public:
  explicit Coulomb(const sim::Params& params)
      : restitution_(params.number("restitution")), friction_(params.number("friction")) {}

  double restitution(double /*approach*/) const override { return restitution_; }
  double friction(double /*speed*/) const override { return friction_; }
  bool constant() const override { return true; }

 private:
  double restitution_, friction_;
};

}  // namespace

SIM_PLUGIN(ContactLaw, "coulomb") {
  registrar.add(sim::Plugin<sim::ContactLaw>{
      {.name = "coulomb",
       .summary = "the same friction and restitution at all speeds",
       .formula = "v_n' = -restitution v_n,  |p_t| <= friction p_n\n"
                  "what colliders and bodies say by friction = and restitution =",
       .source = "Coulomb (1785), Theorie des machines simples; Newton (1687), Principia, scholium "
                 "to the laws of motion",
       .params = {sim::friction_param(), sim::restitution_param()}},
      [](const sim::Params& params) { return std::make_unique<Coulomb>(params); }});
}
