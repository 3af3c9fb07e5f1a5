// `sim SCENE ...`: steps a scene, writes its tables, and reports how far it can be trusted.
#pragma once

#include <cstdint>
#include <optional>

#include "cli/run/recorder.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"
#include "cli/verbs/adjacency.h"
#include "core/engine/step_source.h"
#include "core/output/output.h"
#include "core/report/check.h"
#include "core/study/budget.h"
#include "core/study/run/verification.h"

namespace sim::cli {

enum class ShowProgress { kAuto, kOn, kOff };

struct RunRequest {
  SceneRequest scene;
  std::optional<double> time;  // s, at most one of the two; neither = the scene's duration
  std::optional<std::int64_t> steps;
  std::optional<ParticleChoice> debug_particle;
  std::optional<Target> energy, dump, observe, tension;
  std::optional<std::int64_t> every;  // frames of the tables and rows of the report; 1 in tables
  std::optional<std::string> snap, resume;  // files of checkpoints
  std::optional<double> snap_every;         // s, of wall time; else 15 minutes
  std::optional<std::string> replay;        // a recording; the run is as long as that
  bool from_rest = false;                   // starts where the scene comes to rest
  std::optional<study::Budget> error;       // asked for: method and step are chosen by it
  bool until_horizon = false;               // ends where that is no longer kept
  std::vector<std::string> of;              // figures of observables, for the report
  std::optional<Checks> checks;
  OutRequest out;                               // pictures, films and files for other programs
  std::optional<engine::EngineRequest> engine;  // another program makes the steps, of one system
  std::string export_to;                        // a folder for its files, instead of a run
  std::string export_engine;                    // that they are for
  bool export_file = false;                     // it is a file, of the state the run begins with
  bool export_page = false;                     // it is a page with the kernel in it
  bool json = false, quiet = false;
  ShowProgress progress = ShowProgress::kAuto;
  study::VerificationPlan verify;
};

// The exit code: 0, 4 (diverged), 8 (a check failed), 130 / 143 (interrupted) or that of the first
// failure of the scene or an output on the way; each file is then kept that can be. Throws Error
// for what is wrong before the first step; then files that existed before are as they were.
int run(const RunRequest& request, const Environment& environment, Registry& registry,
        Console& console);

}  // namespace sim::cli
