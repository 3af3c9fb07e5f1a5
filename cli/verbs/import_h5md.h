// `sim import FILE.h5`: a file of H5MD becomes a scene that can be edited.
#pragma once

#include "cli/verbs/import_mesh.h"

namespace sim::cli {

// The scene: the last state, masses, ties as springs; of files that --out wrote also their springs,
// gravity, drag, pins, method and step. Throws Error{kUsage}, Error{kIo}.
int import_h5md(const ImportRequest& request, Console& console);

}  // namespace sim::cli
