// What of a scene can be left out or made smaller, each as a change of what the command line says.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/scene.h"

namespace sim::cli {

struct Part {
  std::string what, option;                  // "force drag"; "--without drag"
  bool again = false;                        // it may be made smaller more than once
  std::function<bool(SceneRequest&)> apply;  // false when there is nothing more to change
};

// The scene outlives them.
std::vector<Part> parts_of(const SceneRequest& request, const LoadedScene& scene,
                           Registry& registry);

// The command of a run, with integrator, step and time.
std::string run_command(const SceneRequest& request, const std::optional<double>& time);

}  // namespace sim::cli
