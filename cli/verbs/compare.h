// `sim compare SCENE`: the same scene side by side with several methods, each with its cost and its
// error against a reference.
#pragma once

#include <optional>
#include <vector>

#include "cli/run/recorder.h"
#include "cli/run/run.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"
#include "core/report/comparison.h"

namespace sim::cli {

using report::ComparedMethod;

struct CompareRequest {
  SceneRequest scene;
  std::vector<ComparedMethod> methods;  // empty: the scene's own and some known ones
  std::optional<double> time;           // s; nothing = the scene's duration
  OutRequest out;
  std::string of;  // an observable, or a figure of it, to be compared, too
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

// A table of the methods; files get a panel of each at equal times, coloured by the error. With
// `json` what `sim compare --help` says. The exit code: 0, or 128 + a signal.
int compare(const CompareRequest& request, const Environment& environment, Registry& registry,
            Console& console);

}  // namespace sim::cli
