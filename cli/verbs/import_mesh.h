// `sim import MESH`: a mesh of another program becomes a scene that can be edited.
#pragma once

#include <string>

#include "cli/terminal/console.h"

namespace sim::cli {

struct ImportRequest {
  std::string mesh;  // .obj or .ply, or .h5
  std::string out;   // .lua; empty: standard output
};

// The scene: the points as particles, springs along the edges and across them, the surface, gravity
// and drag; the highest particle is pinned. Throws Error{kUsage}, Error{kIo}.
int import_mesh(const ImportRequest& request, Console& console);

}  // namespace sim::cli
