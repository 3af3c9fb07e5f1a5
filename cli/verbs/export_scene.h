// `sim export SCENE DIR`: a scene as files that an engine runs, on this machine or another; or as
// one file of its state.
#pragma once

#include "cli/run/checkpoint_file.h"
#include "cli/run/run.h"

namespace sim::cli {

// Writes the files of request.export_to, of each system of a world in a folder in it; `accounts` of
// a run that goes on, or none; `plan` has what was read. Throws Error for what is refused, before
// anything is written, and for a folder that holds results.
int export_scene(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
                 FilePlan plan, Registry& registry, Console& console);

// Writes the present state as a file by its ending; `accounts` of a run that goes on, or none.
int export_state(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
                 FilePlan plan, Registry& registry, Console& console);

// Writes request.export_to, a page with the kernel, the scene and an editor; `plan` has what was
// read. Throws Error{kIo} where ./dev web has built no page, and Error{kUsage} for a scene of files
// that a page cannot hold.
int export_page(const RunRequest& request, const LoadedScene& scene, const Environment& environment,
                FilePlan plan, Console& console);

// Fills in the start of an import of results: the checkpoint and length of the folder, where the
// request says nothing else.
void complete_import(RunRequest& request, const Checkpoint& saved, Registry& registry);

}  // namespace sim::cli
