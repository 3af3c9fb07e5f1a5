// Comparison of the first steps of an engine with those of the kernel.
#pragma once

#include <cstdint>
#include <vector>

#include "core/engine/exchange.h"

namespace sim::engine {

// Takes the first steps of a run with the kernel, and once more from a start perturbed by rounding
// errors, which shows how far apart two correct runs may be.
class FirstSteps {
 public:
  // Takes at most so many steps; afterwards the system is in its former state.
  FirstSteps(Simulation& system, std::int64_t most);

  std::int64_t step() const { return step_; }  // at which states are compared; -1: at none

  struct Answer {
    double digits = 0;  // relative to the distance from the start, rms; infinite: same bits
    bool same = true;   // up to rounding
  };
  // Compares the present state, at step().
  Answer compare(const Simulation& system) const;

 private:
  std::vector<double> start_, end_;  // positions
  std::int64_t step_ = -1;
  double way_ = 0, parted_ = 0;  // m, rms: from the start, and by the shift
};

}  // namespace sim::engine
