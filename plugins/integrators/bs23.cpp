// The pair 3(2) of Bogacki & Shampine (1989), Appl. Math. Lett. 2, 321-325.
#include "core/plugin/embedded_plugin.h"
#include "core/plugin/plugin.h"

namespace {

//    0  |
//   1/2 |  1/2
//   3/4 |   0    3/4
//  -----+---------------------
//    x  |  2/9   1/3   4/9          third order, advances
//       |  7/24  1/4   1/3   1/8    second order, with f(t + h, x_next)
// Dense output: the cubic of Hermite, third order.
constexpr sim::EmbeddedPair<3> kBs23{.method = {.a = {{{0, 0, 0}, {0.5, 0, 0}, {0, 0.75, 0}}},
                                                .b = {2.0 / 9, 1.0 / 3, 4.0 / 9},
                                                .c = {0, 0.5, 0.75}},
                                     .error = {-5.0 / 72, 1.0 / 12, 1.0 / 9, -1.0 / 8}};
static_assert(sim::order_conditions(kBs23.method) == 3);
static_assert(sim::embedded_order(kBs23) == 2);
static_assert(sim::dense_order(kBs23) == 3);

}  // namespace

SIM_PLUGIN(Integrator, "bs23") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "bs23",
       .summary = "Bogacki & Shampine 3(2): adaptive, for tolerances above 1e-4",
       .formula = "k1 = f(t, x), k2 = f(t + h/2, x + h/2 k1), k3 = f(t + 3h/4, x + 3h/4 k2)\n"
                  "x_next = x + h/9 (2 k1 + 3 k2 + 4 k3)    third order, advances\n"
                  "k4 = f(t + h, x_next), the next k1\n"
                  "error = h (-5/72 k1 + k2/12 + k3/9 - k4/8)\n"
                  "R(z) = 1 + z + z^2/2 + z^3/6\n"
                  "dense output of third order",
       .source = "Bogacki & Shampine (1989), Appl. Math. Lett. 2, 321-325",
       .params = sim::embedded_params()},
      [](const sim::Params& params) { return sim::make_embedded(kBs23, 3, params); }});
}
