// `sim stability SCENE`: the vibrations of a scene, and the stable step of each integrator.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/run/run.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct StabilityRequest {
  SceneRequest scene;
  double at = 0;                          // s: the state that the run has reached then
  std::vector<MethodChoice> integrators;  // empty = all that fit
  bool extremes = false;                  // instead of the scene
  std::optional<std::string> svg;         // a file for the plot, of one system
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

// Tables for people; with `json` see `sim stability --help`.
int stability(const StabilityRequest& request, const Environment& environment, Registry& registry,
              Console& console);

}  // namespace sim::cli
