// Looks of pictures, as programs ask for them.
#pragma once

#include "core/c/sim.h"
#include "core/scene/scene_spec.h"

namespace sim::c {

// Null: the look of the scene alone. Throws Error{kUsage}.
LookSpec look_spec(const sim_look* look);

}  // namespace sim::c
