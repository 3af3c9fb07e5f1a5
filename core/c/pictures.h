// Looks of pictures, as programs ask for them.
#pragma once

#include <string>

#include "core/c/sim.h"
#include "core/scene/scene_spec.h"

namespace sim::c {

// Null: the look of the scene alone. Throws Error{kUsage}.
LookSpec look_spec(const sim_look* look);

// Writes the present state of a scene to a file of any kind. Throws Error.
void write_state(sim_scene& scene, const std::string& file);

}  // namespace sim::c
