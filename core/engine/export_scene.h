// A scene as the files of an engine, which runs it on this machine or another.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/engine/engine_run.h"
#include "core/output/file_plan.h"
#include "core/report/checkpoint_file.h"
#include "core/study/run/run_length.h"

namespace sim::engine {

struct ExportTask {
  std::string engine, folder;
  study::RunLength length;
  std::optional<std::int64_t> every = {};  // steps between frames; nothing: a tenth of the run
  std::vector<std::string> without = {};   // parts that were left out of the scene
  report::CheckpointOrigin origin;         // for the start of an import of the results
};

// The files of one system.
struct ExportedPart {
  std::string folder;
  const Simulation* system;
  std::int64_t steps, frames;

  std::string json() const;
};

// The engine of an export; throws Error{kUsage} for one without, `where` being the asker's word for
// it.
std::unique_ptr<Engine> exportable_engine(const std::string& name, const std::string& where,
                                          Registry& registry);

// Writes the files into the folder, of each system of a world into a folder in it; `accounts` of a
// run that goes on, or none; `plan` has what was read. Throws Error for what is refused, before
// anything is written, and for a folder that holds results.
std::vector<ExportedPart> export_scene(const ExportTask& task, const Engine& engine,
                                       StudiedScene& scene,
                                       std::span<const report::Account> accounts, FilePlan plan,
                                       Registry& registry);

}  // namespace sim::engine
