// The parameters that all plugins of embedded Runge-Kutta pairs have in common.
#pragma once

#include "core/ode/explicit/embedded_rk.h"
#include "core/ode/explicit/explicit_rk.h"
#include "core/plugin/plugin_info.h"

namespace sim {

ParamList embedded_params();
Tolerance tolerance_of(const Params& params);

// Makes a method with adaptive steps or, with `fixed_step`, the advancing method of the pair alone.
template <int S, int X, int D>
std::unique_ptr<Integrator> make_embedded(const EmbeddedPair<S, X, D>& pair, int order,
                                          const Params& params) {
  if (params.flag("fixed_step")) return std::make_unique<ExplicitRungeKutta>(pair.method, order);
  return std::make_unique<EmbeddedRungeKutta>(EmbeddedPlan(pair), order, tolerance_of(params));
}

}  // namespace sim
