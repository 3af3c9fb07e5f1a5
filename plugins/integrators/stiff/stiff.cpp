// Pairs of orders 4 and 3: adaptive steps on stiff systems, to a tolerance.
#include "adaptive_implicit.h"
#include "core/plugin/embedded_plugin.h"
#include "core/plugin/plugin.h"
#include "fixed_pair.h"
#include "rosenbrock_stages.h"

namespace {

// The implicit part of ARK4(3)6L[2]SA, Kennedy & Carpenter (2003), appendix C.
constexpr sim::ImplicitPair<6> kPair{
    .method = {.a = {{{},
                      {0.25, 0.25},
                      {8611.0 / 62500, -1743.0 / 31250, 0.25},
                      {5012029.0 / 34652500, -654441.0 / 2922500, 174375.0 / 388108, 0.25},
                      {15267082809.0 / 155376265600, -71443401.0 / 120774400,
                       730878875.0 / 902184768, 2285395.0 / 8070912, 0.25},
                      {82889.0 / 524892, 0, 15625.0 / 83664, 69875.0 / 102672, -2260.0 / 8211,
                       0.25}}},
               .b = {82889.0 / 524892, 0, 15625.0 / 83664, 69875.0 / 102672, -2260.0 / 8211, 0.25},
               .c = {0, 0.5, 83.0 / 250, 31.0 / 50, 17.0 / 20, 1}},
    .embedded = {4586570599.0 / 29645900160, 0, 178811875.0 / 945068544, 814220225.0 / 1159782912,
                 -3700637.0 / 11593932, 61727.0 / 225920}};
static_assert(sim::order_conditions(kPair.method) == 4);
static_assert(sim::embedded_order(kPair) == 3);

// RODAS: L-stable. Hairer & Wanner (1996), Solving ODEs II, section IV.10.
constexpr sim::RosenbrockPair kRodas{
    .gamma = 0.25,
    .a = {{{},
           {1.544},
           {0.9466785280815826, 0.2557011698983284},
           {3.314825187068521, 2.896124015972201, 0.9986419139977817},
           {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950},
           {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1}}},
    .c = {{{},
           {-5.6688},
           {-2.430093356833875, -0.2063599157091915},
           {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
           {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160},
           {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136,
            -6.058818238834054}}},
    .alpha = {0, 0.386, 0.21, 0.63, 1, 1},
    .gammas = {0.25, -0.1043, 0.1035, -0.0362},
    .dense = {{{10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823,
                1.025137723295662},
               {-0.6762803392806898, 6.087714651680015, 16.43084320892478, 24.76722511418386,
                -6.594389125716872}}}};

// Solutions of its equations are no better than rounding allows: below this tolerance neighbouring
// steps cannot be distinguished.
sim::ParamList params() {
  constexpr double kLeast = 1e-10;
  sim::ParamList params = sim::embedded_params();
  for (sim::Param& param : params)
    if (param.name == "tol" || param.name == "rtol") param.min = kLeast;
  return params;
}

}  // namespace

SIM_PLUGIN(Integrator, "esdirk43 rodas4") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "esdirk43",
       .summary = "ESDIRK 4(3): adaptive and stiff; steps to a tolerance, stable with any",
       .formula = "Y_i = x + h sum_{j<i} a_ij k_j + h/4 k_i,  k_i = f(t + c_i h, Y_i),  6 stages\n"
                  "x_next = Y_6;  R(z) -> 0 as z -> -infinity\n"
                  "error = h sum_i (b_i - b'_i) k_i",
       .source = "Kennedy & Carpenter (2003), Appl. Numer. Math. 44, 139-181: implicit part of "
                 "ARK4(3)6L[2]SA",
       .params = params()},
      [](const sim::Params& given) -> std::unique_ptr<sim::Integrator> {
        // The equations of a stage are solved a hundred times better than its error may be.
        constexpr double kPart = 1e-2, kMost = 1e-4, kLeast = 1e-12;
        const sim::Tolerance tolerance = sim::tolerance_of(given);
        sim::StageOptions options{.order = 4};
        if (given.flag("fixed_step"))
          return std::make_unique<sim::DiagonallyImplicit>(kPair.method, 4, options);
        options.tolerance =
            std::clamp(kPart * std::min(tolerance.atol, tolerance.rtol), kLeast, kMost);
        // Slopes follow from the solutions of stages, whose errors must not hide that a step
        // follows a branch that has become unstable.
        constexpr double kOfStages = 1e-4, kLeastAbsolute = 1e-13, kLeastRelative = 1e-12;
        constexpr double kMostOfTolerance = 0.1;
        options.atol = std::max(kOfStages * tolerance.atol,
                                std::min(kLeastAbsolute, kMostOfTolerance * tolerance.atol));
        options.rtol = std::max(kOfStages * tolerance.rtol, kLeastRelative);
        return std::make_unique<sim::AdaptiveImplicit>(kPair, 4, tolerance, options);
      }});
  registrar.add(sim::IntegratorPlugin{
      {.name = "rodas4",
       .summary = "Rosenbrock 4(3): adaptive, for small stiff fields; linear equations alone",
       .formula = "(1/(h gamma) - J) u_i = f(t + alpha_i h, x + sum_{j<i} a_ij u_j)\n"
                  "                        + sum_{j<i} c_ij u_j / h + h gamma_i df/dt\n"
                  "x_next = x + sum_j a_6j u_j + u_6,  J = df/dx,  gamma = 1/4,  6 stages\n"
                  "R(z) -> 0 as z -> -infinity;  error = u_6",
       .source = "Hairer & Wanner (1996), Solving ODEs II, section IV.10: RODAS",
       .params = params()},
      [](const sim::Params& given) -> std::unique_ptr<sim::Integrator> {
        auto stages = std::make_unique<sim::RosenbrockStages>(kRodas);
        if (given.flag("fixed_step")) return std::make_unique<sim::FixedPair>(std::move(stages), 4);
        return std::make_unique<sim::AdaptiveImplicit>(std::move(stages), 4,
                                                       sim::tolerance_of(given),
                                                       sim::StepController::Control::kPredictive);
      }});
}
