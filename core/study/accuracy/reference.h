// What the motion really is, with an error bar of its own.
#pragma once

#include <string>
#include <vector>

#include "core/study/accuracy/trajectory.h"

namespace sim::study {

struct Reference {
  std::string how;                          // "exact solution", "dop853 against pefrl"
  std::vector<std::vector<double>> points;  // as Trajectory::points; empty when told to end
  std::vector<double> error;                // of each point, in m, the largest of any coordinate
  Candidate method;        // the better of the two, and steps with which it is good to about
  std::int64_t steps = 0;  // 1e-6 of the scene's size: for runs that need not be exact
};

// The scene's own exact solution, or else two methods of different families, each refined and
// extrapolated until it no longer improves; what they differ by is the error. Throws Error{kUsage}
// when no method stays finite at any step that can be waited for.
Reference reference(const Problem& problem, double time, int intervals, const Watch& watch);

}  // namespace sim::study
