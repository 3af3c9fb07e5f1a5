// Kutta's third-order method. Kutta (1901), Z. Math. Phys. 46, 435-453.
#include "core/plugin/explicit_plugin.h"
#include "core/plugin/plugin.h"

namespace {

//    0  |
//   1/2 | 1/2
//    1  | -1    2
//  -----+---------------
//       | 1/6  2/3  1/6
constexpr sim::Tableau<3> kRk3{.a = {{{0, 0, 0}, {0.5, 0, 0}, {-1, 2, 0}}},
                               .b = {1.0 / 6, 2.0 / 3, 1.0 / 6},
                               .c = {0, 0.5, 1}};
static_assert(sim::order_conditions(kRk3) == 3);

}  // namespace

SIM_PLUGIN(Integrator, "rk3") {
  registrar.add(sim::explicit_plugin(
      {.name = "rk3",
       .summary = "Kutta's method: three evaluations, third order; h omega < sqrt(3)",
       .formula = "k1 = f(t, x), k2 = f(t + h/2, x + h/2 k1), k3 = f(t + h, x - h k1 + 2 h k2)\n"
                  "x_next = x + h/6 (k1 + 4 k2 + k3)\n"
                  "R(z) = 1 + z + z^2/2 + z^3/6",
       .source = "Kutta (1901), Z. Math. Phys. 46, 435-453"},
      kRk3, 3));
}
