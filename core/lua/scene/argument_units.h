// The units of a scene's arguments against those of the parameters that they are given to.
#pragma once

#include <string>

#include "core/plugin/registry.h"

namespace sim {

// Throws Error{kScene} where the text of a scene gives an argument in one unit to a parameter in
// another: `sim.force.spring { rest = k }` with `local k = sim.arg("k", 50, "N/m")`. The unit of an
// argument is the part of its description between commas that is one. Looked at are arguments that
// are given as they are, by a local name that has one meaning in the file, or without a name; what
// is calculated with them has a unit that is not known.
void check_argument_units(const std::string& text, const std::string& file, Registry& registry);

}  // namespace sim
