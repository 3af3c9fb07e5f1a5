// `sim describe NAME`: a plugin in its own words, or a scene and its parameters.
#pragma once

#include <string>

#include "cli/run/scene.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct DescribeRequest {
  std::string name;    // a plugin, one of its aliases, or a scene
  SceneRequest scene;  // the settings with which a scene is read
  bool json = false;
};

// Throws Error{kUsage} for a name that is neither, with the nearest one.
int describe(const DescribeRequest& request, const Environment& environment, Registry& registry,
             Console& console);

// "64 particles (2 pinned), 306 springs; rk4, 0.005 s a step, 2 s".
std::string system_facts(const Simulation& system);

}  // namespace sim::cli
