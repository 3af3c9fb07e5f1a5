// `sim list --luacats`: the scene language and all plugins as types for editors.
#pragma once

#include <string>

#include "cli/run/environment.h"

namespace sim::cli {

// LuaCATS annotations (LuaLS): a class for the options of each plugin, with its parameters, units
// and defaults, and a function for each of the scene language. Plugins that cannot be opened are
// left out.
std::string luacats(const Environment& environment, Registry& registry);

}  // namespace sim::cli
