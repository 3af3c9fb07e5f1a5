// The failure of a step.
#pragma once

#include <cstdint>
#include <string>

#include "core/ode/outcome.h"

namespace sim {

// The reason why a step could not be taken, or the first number that is not finite. The state is
// the last good one, before that step.
struct Divergence {
  StepStatus status = StepStatus::kDone;
  int particle = 0;       // or an index of `item`; -1 if the status says all
  std::int64_t step = 0;  // the step that failed, counted from 1
  double t = 0, h = 0;    // s, time at the end of that step
  std::string quantity;   // "x", "vy", "component", "memory"
  std::string item;       // of which: StatePart::item, "particle"
  std::string why;        // of kNotAllowed: OdeSystem::refusal()
};

}  // namespace sim
