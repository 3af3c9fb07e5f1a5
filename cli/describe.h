// `sim describe NAME`: a plugin in its own words, or a scene and its parameters.
#pragma once

#include <string>

#include "cli/console.h"
#include "cli/scene.h"

namespace sim::cli {

struct DescribeRequest {
  std::string name;    // a plugin, one of its aliases, or a scene
  SceneRequest scene;  // the settings with which a scene is read
  bool json = false;
};

// Throws Error{kUsage} for a name that is neither, with the nearest one.
int describe(const DescribeRequest& request, const Environment& environment, Registry& registry,
             Console& console);

}  // namespace sim::cli
