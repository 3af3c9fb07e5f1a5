#include "core/plugin/embedded_plugin.h"

namespace sim {

ParamList embedded_params() {
  constexpr double kSmallest = 1e-15, kTiniest = 1e-300;
  return {
      {.name = "tol",
       .default_value = 1e-6,
       .doc = "tolerance of the error of one step in each number of the state, absolute (in its "
              "unit) and relative: |error| <= tol + tol |x|",
       .min = kSmallest,
       .max = 1},
      {.name = "atol", .doc = "the absolute one; tol if not given", .min = kTiniest},
      {.name = "rtol", .doc = "the relative one; tol if not given", .min = 0, .max = 1},
      {.name = "max_step",
       .unit = "s",
       .doc = "no step is longer; for forces that act for a short time only",
       .min = kTiniest},
      {.name = "fixed_step",
       .type = ParamType::kFlag,
       .default_value = false,
       .doc = "steps of size dt, whatever their error; tolerances are not used"}};
}

Tolerance tolerance_of(const Params& params) {
  const double tol = params.number("tol");
  const auto or_else = [&](const char* name, double otherwise) {
    return params.has(name) ? params.number(name) : otherwise;
  };
  return {or_else("atol", tol), or_else("rtol", tol), or_else("max_step", Tolerance{}.max_step)};
}

}  // namespace sim
