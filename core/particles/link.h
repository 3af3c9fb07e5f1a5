// One tie of a force, as adjacency listings show it.
#pragma once

#include <string>

#include "core/particles/springs/spring_sense.h"

namespace sim {

// One spring-like tie of a particle to another, for adjacency listings.
struct Link {
  std::string family;
  int to = 0;
  double stiffness = 0, rest = 0;  // N/m, m
  SpringSense sense = SpringSense::kBoth;

  // N, at this length, m; below 0 it pushes.
  double tension(double length) const {
    return slack(sense, length, rest) ? 0 : stiffness * (length - rest);
  }
};

}  // namespace sim
