// `sim order [INTEGRATOR] [SCENE]`: the observed order of convergence of methods.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/run/run.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct OrderRequest {
  SceneRequest scene;
  std::vector<std::string> words;         // an integrator, a scene, or both in this order
  std::vector<MethodChoice> integrators;  // empty = all that fit
  std::string of;                         // as study::Quantity; empty: positions
  std::optional<double> time;             // s; nothing = the scene's duration, 1 s at most
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

// A table for people, with every step if one integrator is requested; with `json` see `sim order
// --help`.
int order(const OrderRequest& request, const Environment& environment, Registry& registry,
          Console& console);

}  // namespace sim::cli
