// What passes through the particles of a force, and what these pass through, in words.
#pragma once

#include <string>

#include "core/particles/force.h"
#include "core/scene/scene_spec.h"

namespace sim {

// Of the force that this part became; empty where it sees all. The particles of bodies are the
// last.
std::string passing_note(const Force& force, const PartSpec& part, const SystemSpec& spec);

// Of a boundary of colliders that are not the scene's: particles meet them by this force alone.
std::string open_note(const PartSpec& part, const SystemSpec& spec);

// As scenes name it: "sim.collider.plane { ... }".
std::string collider_text(const std::string& plugin, const std::map<std::string, Value>& given);

}  // namespace sim
