// The cost of finite differences in place of a Jacobian.
#pragma once

#include <cstdint>

#include "core/ode/jacobian.h"

namespace sim {

// The evaluations of f that it took so far; 0 for one that is no difference_jacobian().
std::int64_t evaluations_of(const Jacobian& jacobian);

}  // namespace sim
