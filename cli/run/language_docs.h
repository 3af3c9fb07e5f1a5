// The documents of the scene language, from its comments.
#pragma once

#include <map>
#include <string>

#include "cli/run/environment.h"

namespace sim::cli {

// The comments of the scene language, one for each function that they begin with: "grid = sim.grid
// { ..." documents `grid`, "particles:pin(id, ...)" documents `pin`. The text is the comment
// without its dashes.
std::map<std::string, std::string> language_docs(const Environment& environment);

}  // namespace sim::cli
