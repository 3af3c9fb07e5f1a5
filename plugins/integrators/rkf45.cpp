// The pair of Fehlberg (1969), NASA TR R-315, table III ("formula 2").
#include "core/plugin/embedded_plugin.h"
#include "core/plugin/plugin.h"

namespace {

//    0    |
//   1/4   |     1/4
//   3/8   |     3/32       9/32
//  12/13  |  1932/2197 -7200/2197  7296/2197
//    1    |   439/216     -8       3680/513   -845/4104
//   1/2   |    -8/27       2      -3544/2565  1859/4104  -11/40
//  -------+-----------------------------------------------------------
//         |    16/135      0       6656/12825 28561/56430 -9/50  2/55   fifth order
//         |    25/216      0       1408/2565   2197/4104  -1/5    0     fourth order
// Fehlberg advanced the fourth order; here, as usual today, the fifth does (local extrapolation),
// so that the error of a run is proportional to the tolerance. `error` is the difference of the
// rows.
//
// Fehlberg gave no dense output. With k_7 = f(t + h, x_next) the conditions of fourth order leave
// one weight free (compare Horn 1983, SIAM J. Numer. Anal. 20, 558-568); -2 for k_6 makes the
// errors of fifth order small.
constexpr sim::EmbeddedPair<6, 0, 1> kRkf45{
    .method = {.a = {{{},
                      {1.0 / 4},
                      {3.0 / 32, 9.0 / 32},
                      {1932.0 / 2197, -7200.0 / 2197, 7296.0 / 2197},
                      {439.0 / 216, -8, 3680.0 / 513, -845.0 / 4104},
                      {-8.0 / 27, 2, -3544.0 / 2565, 1859.0 / 4104, -11.0 / 40}}},
               .b = {16.0 / 135, 0, 6656.0 / 12825, 28561.0 / 56430, -9.0 / 50, 2.0 / 55},
               .c = {0, 1.0 / 4, 3.0 / 8, 12.0 / 13, 1, 1.0 / 2}},
    .error = {1.0 / 360, 0, -128.0 / 4275, -2197.0 / 75240, 1.0 / 50, 2.0 / 55},
    .dense = {{{-7.0 / 8, 0, 1024.0 / 285, -2197.0 / 456, 8.0 / 5, -2, 5.0 / 2}}}};
static_assert(sim::order_conditions(kRkf45.method) == 5);
static_assert(sim::embedded_order(kRkf45) == 4);
static_assert(sim::dense_order(kRkf45) == 4);

}  // namespace

SIM_PLUGIN(Integrator, "rkf45") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "rkf45",
       .summary = "Fehlberg 4(5): adaptive, the fifth order advances; dopri5 is the better pair",
       .formula = "six stages, x_next = x + h sum_i b_i k_i of fifth order, advances\n"
                  "error = h sum_i (b_i - b^_i) k_i, b^ of fourth order\n"
                  "R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24 + z^5/120 + z^6/2080\n"
                  "dense output of fourth order",
       .source = "Fehlberg (1969), NASA TR R-315, table III",
       .params = sim::embedded_params()},
      [](const sim::Params& params) { return sim::make_embedded(kRkf45, 5, params); }});
}
