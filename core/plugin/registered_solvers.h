// The solvers of implicit methods that a registry has for particles.
#pragma once

#include "core/particles/implicit_solvers.h"

namespace sim {

class Registry;

// Opens the plugin when a method first needs it. The registry outlives the systems.
MakeImplicitSolvers registered_solvers(Registry& registry);

}  // namespace sim
