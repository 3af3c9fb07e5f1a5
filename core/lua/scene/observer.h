// Quantities that a scene observes of its states: observe = { NAME = function(s) ... end }.
#pragma once

#include <memory>
#include <vector>

#include "core/lua/scene/session.h"
#include "core/scene/scene_spec.h"

namespace sim {

// The table at `index`, sorted by name. Each function gets the state as `s`, with the methods
// position, velocity, energy, t and component, and returns a number; it may be used only while the
// function runs. Throws Error{kScene} for what is no such table; an observer throws it for what is
// no number and for its own mistakes, with its line and name.
std::vector<ObserverSpec> read_observers(const std::shared_ptr<SceneSession>& session, lua_State* L,
                                         int index, const SourceLocation& place);

}  // namespace sim
