// `sim NAME SCENE` of a study that a plugin brings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/run/run.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct StudyRequest {
  std::string study;
  SceneRequest scene;
  ValueMap given;              // its own options; texts are converted to the declared types
  std::string of;              // as study::Quantity; empty: positions
  std::optional<double> time;  // s; nothing = the scene's duration
  std::vector<MethodChoice> integrators;  // empty = all that fit
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

// The exit code: 0, or 128 + the signal that ended it. Throws Error, and what the study throws.
int study(const StudyRequest& request, const Environment& environment, Registry& registry,
          Console& console);

}  // namespace sim::cli
