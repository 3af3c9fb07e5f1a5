// BDF of orders 1 to 5: adaptive steps and orders on stiff systems.
#include "multistep.h"

#include <algorithm>

#include "core/plugin/embedded_plugin.h"
#include "core/plugin/plugin.h"

namespace {

// Solutions of its equations are no better than rounding allows.
sim::ParamList params() {
  constexpr double kLeast = 1e-12;
  sim::ParamList params = sim::embedded_params();
  std::erase_if(params, [](const sim::Param& param) { return param.name == "fixed_step"; });
  for (sim::Param& param : params)
    if (param.name == "tol" || param.name == "rtol") param.min = kLeast;
  return params;
}

}  // namespace

SIM_PLUGIN(Integrator, "bdf") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "bdf",
       .summary = "BDF, orders 1 to 5: adaptive, for stiff systems of first order; one equation a "
                  "step",
       .formula = "sum_j alpha_j x_(n-j) = h beta f(t_n, x_n), j = 0 .. q, of steps of any size\n"
                  "order q from 1 to 5 and h: the longest step within the tolerance\n"
                  "A(alpha)-stable: 90, 90, 86, 73, 51 degrees",
       .source = "Gear (1971); Byrne & Hindmarsh (1975), ACM TOMS 1, 71-96; Jackson & Sacks-Davis "
                 "(1980), ACM TOMS 6, 295-318",
       .params = params()},
      [](const sim::Params& given) {
        // A system that does not use tolerances has its equations solved a hundred times better.
        constexpr double kPart = 1e-2, kMost = 1e-4, kLeast = 1e-12;
        const sim::Tolerance tolerance = sim::tolerance_of(given);
        sim::StageOptions options{.order = sim::Bdf::kMostOrder};
        options.tolerance =
            std::clamp(kPart * std::min(tolerance.atol, tolerance.rtol), kLeast, kMost);
        options.atol = tolerance.atol;
        options.rtol = tolerance.rtol;
        return std::make_unique<sim::Bdf>(tolerance, options);
      }});
}
