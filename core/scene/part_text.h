// Parts of a scene in words.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/particles/force.h"
#include "core/particles/scene_names.h"
#include "core/scene/scene_spec.h"

namespace sim {

SceneNames names_of(const SystemSpec& spec);

// The notes of the force that this part became on the scene, with its name.
std::vector<std::string> notes_of(const Force& force, const PartSpec& part,
                                  const SceneNames& names);

// The text by which scenes name it: "sim.collider.plane { ... }".
std::string collider_text(const std::string& plugin, const std::map<std::string, Value>& given);

}  // namespace sim
