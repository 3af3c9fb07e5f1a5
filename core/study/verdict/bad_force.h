// The force responsible for a step that left the finite numbers.
#pragma once

#include <optional>
#include <string>

#include "core/scene/simulation.h"

namespace sim::study {

struct BadForce {
  std::string name, place;  // of its plugin; where the scene wrote it, FILE:LINE
  int particle = 0;         // the first on which it is not finite
};

// Examines the present state and the end of one explicit Euler step of up to h. Empty if every
// force is finite there, or if a coordinate is so large that one may overflow.
std::optional<BadForce> find_bad_force(const SystemSpec& spec, Simulation& system);

}  // namespace sim::study
