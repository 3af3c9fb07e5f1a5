// Reads the look of a scene: look = { eye = {..}, color = "strain", .. }.
#pragma once

#include "core/base/error.h"
#include "core/scene/scene_spec.h"

struct lua_State;

namespace sim {

// The table at `index`. Throws Error{kScene}.
LookSpec read_look(lua_State* L, int index, const SourceLocation& place,
                   const std::vector<std::string>& names);

}  // namespace sim
