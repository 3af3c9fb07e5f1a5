// Differences between two states of one scene.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/scene/simulation.h"

namespace sim {

struct Difference {
  int id = 0;            // of the particle, or an index of `item`
  std::string item;      // StatePart::item: "particle", "component"
  std::string quantity;  // "x", ... "vz", or "component"
  double a = 0, b = 0;   // m, m/s or the unit of the state

  double absolute() const;
  double relative() const;     // to the larger of the two
  std::uint64_t ulps() const;  // doubles from the one to the other; of -0 and 0 none
};

// The first number, by particle, whose bits differ. The simulations are of the same scene;
// otherwise parts of the state that only one of them has do not count.
std::optional<Difference> first_difference(const Simulation& a, const Simulation& b);

// The number that differs most; of one position, velocity or component. Empty if all are equal.
std::optional<Difference> largest_difference(const Simulation& a, const Simulation& b);

}  // namespace sim
