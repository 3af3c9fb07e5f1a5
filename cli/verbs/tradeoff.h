// `sim tradeoff SCENE`: speed against accuracy of every integrator, and a recommendation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/run/run.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"
#include "core/output/output.h"
#include "core/study/budget.h"

namespace sim::cli {

struct TradeoffRequest {
  SceneRequest scene;
  study::Budget budget;                   // 0.1 % of the size if not given
  std::string of;                         // as study::Quantity; empty: positions
  std::optional<double> time;             // s; nothing = the scene's duration
  std::vector<MethodChoice> integrators;  // empty = all that fit
  std::optional<Target> csv;              // every point, .csv or .jsonl
  std::optional<std::string> svg;         // a file for the plot, of one system
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

// A table for people; with `json` what `sim tradeoff --help` says. Errors in m, or as numbers of a
// flat state or of `of`: the largest rms of all steps.
int tradeoff(const TradeoffRequest& request, const Environment& environment, Registry& registry,
             Console& console);

}  // namespace sim::cli
