// `sim plugin new KIND NAME`: a folder to start a plugin from; `sim plugin flags`.
#pragma once

#include <string>

#include "cli/terminal/console.h"

namespace sim::cli {

struct NewPluginRequest {
  bool flags = false;     // print the options by which g++ builds a plugin, and end
  std::string kind = {};  // force, field, integrator, constraint, collider, motion, law ..
  std::string name = {};  // letters, digits and _; also of the folder
};

// Writes NAME/ with NAME.cpp, CMakeLists.txt, NAME.lua and README.md, and prints the commands that
// build and test it. Throws Error{kUsage} for a kind without a template or a bad name, and
// Error{kIo} if the folder is there already: nothing is overwritten.
int new_plugin(const NewPluginRequest& request, Console& console);

}  // namespace sim::cli
