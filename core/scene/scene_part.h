// A scene of some of the particles of another one.
#pragma once

#include <span>

#include "core/scene/scene_spec.h"

namespace sim {

// The part of `whole` with the particles of `ids`, ascending, renumbered: the elements, surfaces,
// bodies, pins and numbers of these alone. No element of a force or constraint joins one of them to
// another particle, and bodies are whole. Empty parts are left out. The pairs of a grid stay pairs
// of a grid if all of its particles are included.
SystemSpec scene_part(const SystemSpec& whole, std::span<const int> ids);

}  // namespace sim
