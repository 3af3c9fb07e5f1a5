// Forward Euler. Euler (1768), Institutionum calculi integralis I, section 650.
#include "core/plugin/explicit_plugin.h"
#include "core/plugin/plugin.h"

namespace {

constexpr sim::Tableau<1> kEuler{.a = {}, .b = {1}, .c = {0}};
static_assert(sim::order_conditions(kEuler) == 1);

}  // namespace

SIM_PLUGIN(Integrator, "euler/e") {
  registrar.add(sim::explicit_plugin(
      {.name = "euler",
       .summary = "forward Euler: one evaluation, first order; unstable on undamped springs",
       .formula = "x_next = x + h f(t, x)\nR(z) = 1 + z",
       .source = "Euler (1768), Institutionum calculi integralis I, section 650"},
      kEuler, 1));
}
