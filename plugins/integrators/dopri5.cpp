// The pair RK5(4)7M of Dormand & Prince (1980), J. Comput. Appl. Math. 6, 19-26.
#include "core/plugin/embedded_plugin.h"
#include "core/plugin/plugin.h"

namespace {

//    0   |
//   1/5  |     1/5
//   3/10 |     3/40        9/40
//   4/5  |    44/45      -56/15       32/9
//   8/9  | 19372/6561 -25360/2187  64448/6561  -212/729
//    1   |  9017/3168   -355/33    46732/5247    49/176   -5103/18656
//  ------+----------------------------------------------------------------------------
//    x   |    35/384       0         500/1113   125/192   -2187/6784   11/84           fifth order
//        |  5179/57600     0        7571/16695  393/640  -92097/339200 187/2100  1/40  fourth order
// The fifth order advances; the last stage is f(t + h, x_next). `error` is the difference of the
// rows. Dense output of fourth order: Hairer, Norsett & Wanner, Solving ODEs I (1993), section II.6
// and its code DOPRI5.
constexpr sim::EmbeddedPair<6, 0, 1> kDopri5{
    .method = {.a = {{{},
                      {1.0 / 5},
                      {3.0 / 40, 9.0 / 40},
                      {44.0 / 45, -56.0 / 15, 32.0 / 9},
                      {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                      {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656}}},
               .b = {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
               .c = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1}},
    .error = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525,
              -1.0 / 40},
    .dense = {
        {{-12715105075.0 / 11282082432, 0, 87487479700.0 / 32700410799, -10690763975.0 / 1880347072,
          701980252875.0 / 199316789632, -1453857185.0 / 822651844, 69997945.0 / 29380423}}}};
static_assert(sim::order_conditions(kDopri5.method) == 5);
static_assert(sim::embedded_order(kDopri5) == 4);
static_assert(sim::dense_order(kDopri5) == 4);

}  // namespace

SIM_PLUGIN(Integrator, "dopri5") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "dopri5",
       .summary = "Dormand & Prince 5(4): adaptive, for tolerances from 1e-3 to 1e-8",
       .formula = "six stages, x_next = x + h sum_i b_i k_i of fifth order, advances\n"
                  "error = h sum_i (b_i - b^_i) k_i with k_7 = f(t + h, x_next), the next k_1\n"
                  "R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24 + z^5/120 + z^6/600\n"
                  "dense output of fourth order",
       .source = "Dormand & Prince (1980), J. Comput. Appl. Math. 6, 19-26",
       .params = sim::embedded_params()},
      [](const sim::Params& params) { return sim::make_embedded(kDopri5, 5, params); }});
}
