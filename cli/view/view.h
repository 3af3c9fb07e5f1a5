// `sim view SCENE`: a scene that runs in real time, in a page or in the terminal, to be touched.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/run/scene.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct ViewRequest {
  SceneRequest scene;
  int port = 0;      // 0: one that is free
  bool open = true;  // in the browser, where there is one
  bool terminal = false;
  bool pause_hidden = false;          // while no eye is on a page it pauses
  std::vector<MethodChoice> compare;  // several: the scene once with each, under the same hands
  std::optional<std::string> record;
};

// Until it is closed: 0, or 128 + the signal that ended it. Throws Error.
int view(const ViewRequest& request, const Environment& environment, Registry& registry,
         Console& console);

}  // namespace sim::cli
