// The changes that a reload made to a scene, in words.
#pragma once

#include <string>
#include <vector>

#include "cli/run/scene.h"

namespace sim::cli {

struct Change {
  std::string what, before, after;
};
std::vector<Change> differences(const LoadedScene& before, const LoadedScene& after);

}  // namespace sim::cli
