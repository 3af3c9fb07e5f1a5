// `sim stability --extremes`: the verdict on every integrator at the extremes.
#pragma once

#include "cli/run/environment.h"
#include "cli/terminal/console.h"
#include "cli/verbs/stability.h"

namespace sim::cli {

// A map an integrator. With `json` {"complete","integrators":[{"name","trusted","suspect",
// "diverged","not_run","silently_wrong","cells":[{"stiffness","mass","dt","offset","verdict",
// "error","reason"}]}]}.
int extremes(const StabilityRequest& request, Registry& registry, Console& console);

}  // namespace sim::cli
