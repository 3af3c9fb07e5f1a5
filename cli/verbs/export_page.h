// `sim export SCENE --format page FILE.html`: a page with the kernel, the scene and an editor.
#pragma once

#include "cli/run/run.h"

namespace sim::cli {

// Writes request.export_to; `plan` has what was read. Throws Error{kIo} where ./dev web has built
// no page, and Error{kUsage} for a scene of files that a page cannot hold.
int export_page(const RunRequest& request, const LoadedScene& scene, const Environment& environment,
                FilePlan plan, Console& console);

}  // namespace sim::cli
