// `sim import MESH` or `sim import FILE.h5`: a file of another program becomes a scene.
#pragma once

#include <string>

#include "cli/terminal/console.h"

namespace sim::cli {

struct ImportRequest {
  std::string mesh;  // .obj or .ply, or .h5
  std::string out;   // .lua; empty: standard output
};

// Throws Error{kUsage}, Error{kIo}.
int import_scene(const ImportRequest& request, Console& console);

}  // namespace sim::cli
