// Judged runs of all kinds: of the kernel, of a recording, of an engine.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/c/choice.h"
#include "core/engine/step_source.h"
#include "core/study/run/run_length.h"

namespace sim::c {

struct RunTask {
  double time = 0;  // s, from now; not above 0: to the end of the scene's duration
  std::optional<study::RunLength> length = {};  // from the start of the scene, in its place
  int verify = 1;                               // as sim_run() takes it
  report::Replays* replays = nullptr;           // whose actions it performs, and how long it is
  const engine::EngineRequest* engine = nullptr;
  std::optional<std::int64_t> rows = {};      // steps between states that an engine shows
  std::vector<std::string>* notes = nullptr;  // receives those of engines
};

void check_verify(int verify);

// Leaves a verdict and the books of the run. Throws Error.
void run(sim_scene& scene, const RunTask& task, Watcher& watcher);

}  // namespace sim::c
