// `sim describe NAME`: a plugin or a function of scenes in its own words, or a scene and its
// parameters.
#pragma once

#include <string>

#include "cli/run/scene.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct DescribeRequest {
  std::string name;    // a plugin, one of its aliases, a scene, or "sim.grid", "grid", "pin"
  SceneRequest scene;  // the settings with which a scene is read
  bool json = false;
  std::vector<std::string> others = {};  // names that may have been meant, besides
};

// Throws Error{kUsage} for a name that is none of these, with the nearest one.
int describe(const DescribeRequest& request, const Environment& environment, Registry& registry,
             Console& console);

// "64 particles (2 pinned), 306 springs; rk4, 0.005 s a step, 2 s".
std::string system_facts(const Simulation& system);

}  // namespace sim::cli
