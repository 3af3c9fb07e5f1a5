// Panels of a picture, one for each system of a world.
#pragma once

#include <string>
#include <vector>

#include "core/picture/model.h"

namespace sim {

// Systems that show the same quantities, side by side in equal panels.
struct Panels {
  std::vector<std::vector<std::string>> captions;  // lines of each; none: there are no panels
  std::vector<Moment> stage;                       // of one system, which the viewpoint holds

  bool any() const { return !captions.empty(); }
};

}  // namespace sim
