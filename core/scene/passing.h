// What passes through the particles of a force, in words.
#pragma once

#include <string>

#include "core/particles/force.h"
#include "core/scene/scene_spec.h"

namespace sim {

// Of the force that this part became; empty where it sees all. The particles of bodies are the
// last.
std::string passing_note(const Force& force, const PartSpec& part, const SystemSpec& spec);

}  // namespace sim
