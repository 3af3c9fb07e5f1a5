// The parameters that all constraints have in common.
#pragma once

#include <vector>

#include "core/plugin/params.h"

namespace sim {

// The parameters of a constraint behind its own.
ParamList constraint_params(ParamList own);

}  // namespace sim
