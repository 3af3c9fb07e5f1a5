// The reference solution of the motion, with an error bar of its own.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "core/study/accuracy/trajectory.h"

namespace sim::study {

// The number of intervals between displayed times, and the first step count of a sweep.
inline constexpr int kIntervals = 20;

struct Reference {
  std::string how;  // "extrapolation against dop853", "exact solution against extrapolation"
  // The compared numbers at equal times, [k] at k time / intervals(); empty when told to end.
  std::vector<std::vector<double>> points;
  std::vector<double> error;     // of each point, the largest of any number: how far the two differ
  double figure = std::nan("");  // if the problem asks for one; `error` is then its own
  Candidate method;              // one good to about 1e-6 of the scene's size, with so many steps:
  std::int64_t steps = 0;        // for runs that need not be exact
  int own_intervals = 0;         // where ties may break: nearly as many as steps of the user's run
  bool contact = false;          // states are corrected by contact

  int intervals() const { return static_cast<int>(points.size()) - 1; }
  // The steps' ends of adaptive runs that are compared with it. Ties break there.
  int adaptive_intervals() const { return own_intervals > 0 ? own_intervals : intervals(); }
  int seen_of(std::int64_t count) const;  // how many of so many equal steps are points
};

// The number of points of a reference of the problem.
int reference_intervals(const Problem& problem, Simulation& system);

// The range of the compared quantity over time; its size where it never changes. The range of a
// period is the period.
double range_of(const Problem& problem, const Reference& reference);

// The scene's own exact solution or the extrapolated midpoint rule, checked by a method of another
// family refined until it no longer improves; their difference is the error. If neither exists, two
// families of integrators are compared. The points are as close as memory allows, 60 2^k intervals.
// Throws Error{kUsage} if no method stays finite at any affordable step.
Reference reference(const Problem& problem, double time, const Watch& watch);

}  // namespace sim::study
