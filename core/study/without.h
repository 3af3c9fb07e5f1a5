// A scene without some of its parts.
#pragma once

#include <string>

#include "core/scene/scene_spec.h"

namespace sim::study {

// Leaves a part out of all systems, or of one of a world: "gravity", "cloth.gravity". Throws
// Error{kUsage} for a name that no force, collider or family of springs has.
void leave_out(const std::string& name, SceneSpec& scene);

// Turns off the parts with this switch in every system. Throws Error{kUsage} if there are none.
void turn_off(const std::string& name, SceneSpec& scene);

}  // namespace sim::study
