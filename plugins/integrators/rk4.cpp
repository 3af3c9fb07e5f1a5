// The classical Runge-Kutta method. Kutta (1901), Z. Math. Phys. 46, 435-453.
#include "core/plugin/explicit_plugin.h"
#include "core/plugin/plugin.h"

namespace {

//    0  |
//   1/2 | 1/2
//   1/2 |  0   1/2
//    1  |  0    0    1
//  -----+--------------------
//       | 1/6  1/3  1/3  1/6
constexpr sim::Tableau<4> kRk4{.a = {{{0, 0, 0, 0}, {0.5, 0, 0, 0}, {0, 0.5, 0, 0}, {0, 0, 1, 0}}},
                               .b = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6},
                               .c = {0, 0.5, 0.5, 1}};
static_assert(sim::order_conditions(kRk4) == 4);

}  // namespace

SIM_PLUGIN(Integrator, "rk4/r") {
  registrar.add(sim::explicit_plugin(
      {.name = "rk4",
       .summary = "classical Runge-Kutta: four evaluations, fourth order; the safe first choice",
       .formula = "k1 = f(t, x), k2 = f(t + h/2, x + h/2 k1)\n"
                  "k3 = f(t + h/2, x + h/2 k2), k4 = f(t + h, x + h k3)\n"
                  "x_next = x + h/6 (k1 + 2 k2 + 2 k3 + k4)\n"
                  "R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24",
       .source = "Kutta (1901), Z. Math. Phys. 46, 435-453"},
      kRk4, 4));
}
