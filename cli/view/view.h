// `sim view SCENE`: a scene that runs in real time, in a page, a window or the terminal, to be
// touched.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/scene.h"
#include "cli/terminal/console.h"
#include "core/session/recording.h"
#include "core/session/timeline.h"

namespace sim::cli {

struct ViewRequest {
  SceneRequest scene;
  int port = 0;      // 0: one that is free
  bool open = true;  // in the browser, where there is one
  bool terminal = false, window = false;
  bool pause_hidden = false;          // while no eye is on a page it pauses
  std::vector<MethodChoice> compare;  // several: the scene once with each, under the same hands
  std::optional<std::string> record;
};

// Until it is closed: 0, or 128 + the signal that ended it. Throws Error.
int view(const ViewRequest& request, const Environment& environment, Registry& registry,
         Console& console);

// A scene that is there already, from where it is, at rest at first; its timelines are lent to it.
// Until it is closed, or a signal was caught. The user's actions go to the writers.
void view_present(LoadedScene& scene, std::vector<Timeline>& timelines, const ViewRequest& request,
                  const std::vector<RecordingWriter*>& writers, const Environment& environment,
                  Registry& registry, Console& console, const std::function<int()>& caught);

}  // namespace sim::cli
