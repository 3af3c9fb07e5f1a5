// Splitting methods for q' = v, v' = a(t, q) - gamma v: exact drifts and kicks in turn. The kick
// holds the damping, v := e^(-gamma k h) v + (1 - e^(-gamma k h)) / gamma a(t, q), so that it costs
// no order. Hairer, Lubich & Wanner (2006), Geometric Numerical Integration, sections II.4, II.5
// and VI.3.
#include "core/ode/explicit/splitting.h"
#include "core/plugin/explicit_plugin.h"
#include "core/plugin/plugin.h"

namespace {

// Kick, then drift.
constexpr sim::Composition<1> kSymplecticEuler{.drift = {0, 1}, .kick = {1}};
static_assert(sim::order_conditions(kSymplecticEuler) == 1);

// Half a kick, drift, half a kick. Verlet (1967).
constexpr sim::Composition<2> kVerlet{.drift = {0, 1, 0}, .kick = {0.5, 0.5}};
static_assert(sim::order_conditions(kVerlet) == 2);

// Position extended Forest-Ruth like, Omelyan, Mryglod & Folk (2002), equations (20) and (22):
// xi | (1 - 2 lambda) / 2 | chi | lambda | 1 - 2 (chi + xi) | lambda | chi | ... | xi
constexpr double kXi = 0.1786178958448091, kLambda = -0.2123418310626054,
                 kChi = -0.06626458266981849;
constexpr sim::Composition<4> kPefrl{
    .drift = {kXi, kChi, 1 - 2 * (kChi + kXi), kChi, kXi},
    .kick = {(1 - 2 * kLambda) / 2, kLambda, kLambda, (1 - 2 * kLambda) / 2}};
static_assert(sim::order_conditions(kPefrl) == 4);

// Leapfrog steps of w1 h, w0 h, w1 h with 2 w1 + w0 = 1 and 2 w1^3 + w0^3 = 0, Yoshida (1990),
// equation (2.11): w1 = 1 / (2 - 2^(1/3)).
constexpr double kW1 = 1.351207191959657634, kW0 = 1 - 2 * kW1;
constexpr sim::Composition<3> kYoshida4{
    .drift = {kW1 / 2, (kW0 + kW1) / 2, (kW0 + kW1) / 2, kW1 / 2}, .kick = {kW1, kW0, kW1}};
static_assert(sim::order_conditions(kYoshida4) == 4);

template <int M>
void add(sim::Registrar& registrar, sim::PluginInfo info, const sim::Composition<M>& method) {
  info.formula +=
      "\nwith damping gamma a kick of length k is exactly\n"
      "v := e^(-gamma k) v + (1 - e^(-gamma k)) / gamma a";
  info.params.push_back(sim::precision_param());
  registrar.add(sim::IntegratorPlugin{std::move(info), [method](const sim::Params& params) {
                                        return std::make_unique<sim::Splitting>(
                                            method, sim::precision_of(params));
                                      }});
}

}  // namespace

SIM_PLUGIN(Integrator, "symplectic_euler verlet pefrl yoshida4") {
  add(registrar,
      {.name = "symplectic_euler",
       .summary = "symplectic Euler: kick, then drift; robust, first order",
       .formula = "v += h a(t, q);  q += h v",
       .source = "Hairer, Lubich & Wanner (2003), Acta Numerica 12, 399-450"},
      kSymplecticEuler);
  add(registrar,
      {.name = "verlet",
       .summary = "velocity Verlet: the cheapest per step; first choice for springs",
       .formula = "v += h/2 a(t, q);  q += h v;  v += h/2 a(t + h, q)",
       .source = "Verlet (1967), Phys. Rev. 159, 98-103"},
      kVerlet);
  add(registrar,
      {.name = "pefrl",
       .summary = "position extended Forest-Ruth like: accurate and symplectic; a step of it is "
                  "worth four of verlet",
       .formula = "q += xi h v;            v += (1/2 - lambda) h a\n"
                  "q += chi h v;           v += lambda h a\n"
                  "q += (1 - 2 chi - 2 xi) h v;  then the same backwards\n"
                  "xi = 0.1786178958448091, lambda = -0.2123418310626054,\n"
                  "chi = -0.06626458266981849",
       .source =
           "Omelyan, Mryglod & Folk (2002), Comput. Phys. Commun. 146, 188-202, eq. (20), (22)"},
      kPefrl);
  add(registrar,
      {.name = "yoshida4",
       .summary =
           "three leapfrog steps, the second backwards (with drag keep h c/m below 1); pefrl "
           "is more accurate and stable",
       .formula = "leapfrog (drift w h/2, kick w h, drift w h/2) with w = w1, w0, w1\n"
                  "w1 = 1 / (2 - 2^(1/3)),  w0 = 1 - 2 w1",
       .source = "Yoshida (1990), Phys. Lett. A 150, 262-268, eq. (2.11)"},
      kYoshida4);
}
