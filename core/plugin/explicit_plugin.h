// The parameter that all plugins of explicit methods with equal steps have in common: the precision
// of a step.
#pragma once

#include <utility>

#include "core/ode/explicit/explicit_rk.h"
#include "core/plugin/plugin_info.h"

namespace sim {

Param precision_param();
Precision precision_of(const Params& params);

template <int S>
IntegratorPlugin explicit_plugin(PluginInfo info, const Tableau<S>& method, int order) {
  info.params.push_back(precision_param());
  return {std::move(info), [method, order](const Params& params) {
            return std::make_unique<ExplicitRungeKutta>(method, order, precision_of(params));
          }};
}

}  // namespace sim
