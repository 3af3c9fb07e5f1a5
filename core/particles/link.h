// Spring-like links between particles, for adjacency listings.
#pragma once

#include <string>

#include "core/particles/springs/spring_sense.h"

namespace sim {

// A spring-like link from a particle to another one.
struct Link {
  std::string family;
  int to = 0;
  double stiffness = 0, rest = 0;  // N/m, m
  SpringSense sense = SpringSense::kBoth;

  // The force, N, at this length, m; negative when it pushes.
  double tension(double length) const {
    return slack(sense, length, rest) ? 0 : stiffness * (length - rest);
  }
};

}  // namespace sim
