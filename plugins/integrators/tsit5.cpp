// The pair 5(4) of Tsitouras (2011), Comput. Math. Appl. 62, 770-775.
#include "core/plugin/embedded_plugin.h"
#include "core/plugin/plugin.h"

namespace {

// Sections 3 and 4 of the paper, which gives only decimals. The fifth order advances and the last
// stage is f(t + h, x_next). The dense output of fourth order is written there as b_i(theta) of
// degree four; its leading coefficients are its difference from the cubic of Hermite.
constexpr sim::EmbeddedPair<6, 0, 1> kTsit5{
    .method = {.a = {{{},
                      {0.161},
                      {-0.008480655492356989, 0.335480655492357},
                      {2.8971530571054935, -6.359448489975075, 4.3622954328695815},
                      {5.325864828439257, -11.748883564062828, 7.4955393428898365,
                       -0.09249506636175525},
                      {5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401,
                       -0.028269050394068383}}},
               .b = {0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742,
                     -3.290069515436081, 2.324710524099774},
               .c = {0, 0.161, 0.327, 0.9, 0.9800255409045097, 1}},
    .error = {-0.00178001105222577714, -0.0008164344596567469, 0.007880878010261995,
              -0.1447110071732629, 0.5823571654525552, -0.45808210592918697, 1.0 / 66},
    .dense = {{{-1.0530884977290216, 0.1017, 2.490627285651252793, -16.54810288924490272,
                47.37952196281928122, -34.87065786149660974, 2.5}}}};
static_assert(sim::order_conditions(kTsit5.method) == 5);
static_assert(sim::embedded_order(kTsit5) == 4);
static_assert(sim::dense_order(kTsit5) == 4);

}  // namespace

SIM_PLUGIN(Integrator, "tsit5") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "tsit5",
       .summary = "Tsitouras 5(4): adaptive, for tolerances from 1e-3 to 1e-8; smaller errors than "
                  "dopri5",
       .formula = "six stages, x_next = x + h sum_i b_i k_i of fifth order, advances\n"
                  "error = h sum_i (b_i - b^_i) k_i with k_7 = f(t + h, x_next), the next k_1\n"
                  "R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24 + z^5/120 + 0.00143219 z^6\n"
                  "dense output of fourth order",
       .source = "Tsitouras (2011), Comput. Math. Appl. 62, 770-775",
       .params = sim::embedded_params()},
      [](const sim::Params& params) { return sim::make_embedded(kTsit5, 5, params); }});
}
