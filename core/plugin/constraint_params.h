// What all constraints have in common.
#pragma once

#include <vector>

#include "core/plugin/params.h"

namespace sim {

// The parameters of a constraint behind its own.
std::vector<Param> constraint_params(std::vector<Param> own);

}  // namespace sim
