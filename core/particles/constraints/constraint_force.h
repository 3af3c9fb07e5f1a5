// The forces of constraints at one state, and how well they are satisfied there.
#pragma once

#include <string>

#include "core/math/vec3.h"

namespace sim {

// The force of a constraint on two particles, or on one.
struct ConstraintForce {
  std::string constraint, name;  // of the plugin; "rod 3-7" or empty
  int a = 0, b = -1;             // particles; -1: none
  double tension = 0;            // N: how much the two are pulled together, or |force|
  Vec3 force{0, 0, 0};           // N, on a
};

// The constraint violation of a state: the largest |phi|, m, and |J v + drive|, m/s.
struct ConstraintDrift {
  double position = 0, velocity = 0;
};

}  // namespace sim
