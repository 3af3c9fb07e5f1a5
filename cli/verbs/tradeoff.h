// `sim tradeoff SCENE`: speed against accuracy of every integrator, and which to take.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/run/run.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"
#include "core/output/output.h"

namespace sim::cli {

// "1%" of the scene's size, or metres: "1e-3 m", "1e-3".
struct Budget {
  double value = 1e-3;
  bool in_metres = false;
};

struct TradeoffRequest {
  SceneRequest scene;
  Budget budget;                          // 0.1 % of the size if not given
  std::optional<double> time;             // s; nothing = the scene's duration
  std::vector<MethodChoice> integrators;  // empty = all that fit
  std::optional<Target> csv;              // every point, .csv or .jsonl
  std::optional<std::string> svg;         // a file for the plot, of one system
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

// A table for people; with `json` one object, for a world {"systems":[...]} of them:
//   {"system","time","size","budget","comparable","reference":{"how","error"},"growth","omega_max",
//    "complete","recommended":{"integrator","dt","tol","error","evaluations"},"cheapest":{...},
//    "integrators":[{"name","order","observed","limit","points":[{"dt","tol","status","error",
//    "relative","error_end","max_end","worst","energy","steps","evaluations","newton",
//    "factorisations","linear","cost","seconds","spread","front"}]}]}
// Errors in m: "error" is the largest rms over the free coordinates along the way.
int tradeoff(const TradeoffRequest& request, const Environment& environment, Registry& registry,
             Console& console);

}  // namespace sim::cli
