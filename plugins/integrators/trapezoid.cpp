// The explicit trapezoidal rule, also known as Heun's method. Heun (1900), Z. Math. Phys. 45,
// 23-38.
#include "core/plugin/explicit_plugin.h"
#include "core/plugin/plugin.h"

namespace {

//   0 |
//   1 |  1
//  ---+---------
//     | 1/2  1/2
constexpr sim::Tableau<2> kTrapezoid{.a = {{{0, 0}, {1, 0}}}, .b = {0.5, 0.5}, .c = {0, 1}};
static_assert(sim::order_conditions(kTrapezoid) == 2);

}  // namespace

SIM_PLUGIN(Integrator, "trapezoid/t") {
  registrar.add(sim::explicit_plugin(
      {.name = "trapezoid",
       .summary =
           "explicit trapezoidal rule (Heun): two evaluations, second order; stable only with drag",
       .formula = "k1 = f(t, x), k2 = f(t + h, x + h k1)\n"
                  "x_next = x + h/2 (k1 + k2)\n"
                  "R(z) = 1 + z + z^2/2",
       .source = "Heun (1900), Z. Math. Phys. 45, 23-38"},
      kTrapezoid, 2));
}
