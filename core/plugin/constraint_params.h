// The parameters that all constraints have in common.
#pragma once

#include <vector>

#include "core/plugin/params.h"

namespace sim {

// The own parameters of a constraint, followed by the common ones.
ParamList constraint_params(ParamList own);

}  // namespace sim
