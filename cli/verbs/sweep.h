// `sim sweep SCENE`: one scene many times, a row of a table each.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/judged.h"
#include "cli/run/run.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"
#include "core/output/output.h"
#include "core/report/check.h"

namespace sim::cli {

struct SweepRequest {
  SceneRequest scene;             // its threads: cases at once
  std::vector<std::string> over;  // --over NAME=VALUES; either these
  std::string cases;              // ... or a file of cases
  RunLength length;               // of all cases, where these do not say it
  std::optional<Checks> checks;
  std::vector<std::string> of;         // figures of observables: columns
  std::string out;                     // the table; empty: standard output, nothing is kept
  std::int64_t part = 0, parts = 1;    // takes the cases with index % parts == part
  bool list = false, collect = false;  // no runs: the list of cases; the table of those done
  bool keep_failed = false;            // a case that failed is not tried again
  bool verify = true;                  // each run once more with half the step
  std::optional<double> timeout;       // s, of a case
  ShowProgress progress = ShowProgress::kAuto;
};

// A case that failed is tried again the next time. Each case is a process of its own, so that one
// that crashes or hangs is a row. The exit code: 0, 9 when a case failed (one that diverged did
// not), 128 + a signal. Throws Error{kUsage} for names that neither runs nor the scene know, before
// anything is run.
int sweep(const SweepRequest& request, const Environment& environment, Registry& registry,
          Console& console);

}  // namespace sim::cli
