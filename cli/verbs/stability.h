// `sim stability SCENE`: how fast a scene vibrates, and how large a step each integrator stands.
#pragma once

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
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

// Tables for people, or with `json` one object, for a world {"systems":[...]} of them:
//   {"system","t","omega_max","damping","residual","bound","growth",
//    "particles":[{"particle","share"}],"families":[{"family","share"}],
//    "integrator","dt","energy_time","complete","integrators":[
//      {"name","order","predicted_dt","measured_dt","limit","radius",
//       "energy":[{"fraction","dt","error"}]}]}
// predicted_dt and measured_dt in s, 0 where no step is stable, null where every step is or it is
// not known; limit says which: "step", "none stable", "unlimited", "own steps" (adaptive),
// "unknown". radius is the growth of the fastest mode in one step of dt.
int stability(const StabilityRequest& request, const Environment& environment, Registry& registry,
              Console& console);

}  // namespace sim::cli
