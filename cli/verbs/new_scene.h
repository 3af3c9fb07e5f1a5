// `sim scene new NAME`: a folder to start a scene from.
#pragma once

#include <string>

#include "cli/terminal/console.h"

namespace sim::cli {

struct NewSceneRequest {
  std::string name = {};  // letters, digits and _; also of the folder
};

// Writes NAME/ with NAME.lua, a scene that runs, and .luarc.json, by which editors know the types
// of the scene language. Throws Error{kUsage} for a bad name, and Error{kIo} if the folder is there
// already: nothing is overwritten.
int new_scene(const NewSceneRequest& request, Console& console);

}  // namespace sim::cli
