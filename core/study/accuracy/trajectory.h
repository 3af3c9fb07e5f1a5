// A run as a study sees it: the free coordinates at equal intervals of time, and the cost.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/particles/constraints/constraint_force.h"
#include "core/study/acted.h"
#include "core/study/problem.h"

namespace sim::study {

struct Trajectory {
  double time = 0;         // s, of the whole
  std::int64_t steps = 0;  // taken
  Effort effort;           // evaluations are filled in for methods that do not count
  // Largest |E + W - E0| over the energy in play; not a number in a first-order system, or if W is
  // not known well enough.
  double energy_error = std::nan("");
  std::optional<ConstraintDrift> drift;  // at the end, where there are constraints
  double seconds = 0;                    // of stepping alone
  bool finished = false;
  Acted acted;
};

struct TrajectoryPlan {
  double time = 0;                           // s
  int intervals = 20;                        // at least 1
  std::int64_t steps = 0;                    // a multiple of `intervals`
  double tolerance = 0;                      // of methods that have one; 0 = their own
  bool energy = false;                       // watch it: not in runs that are timed
  bool shifted = false;                      // by half a step: its steps end between the others
  std::function<void(Simulation&)> begin{};  // changes the start
  // Called with the compared numbers at k time / intervals, from k = 0 on, as far as the run gets.
  std::function<void(int k, const std::vector<double>&)> see{};
};

// Ends early, unfinished, if `go_on` says so, which is asked about once a millisecond.
Trajectory run_trajectory(const Problem& problem, const Candidate& method,
                          const TrajectoryPlan& plan, const std::function<bool()>& go_on);

// Shows the state at time t of a run whose steps end between those of others: a short step leads
// there from the last whole one, and is taken back. False if a step fails or `go_on` says so.
bool look_between_steps(Simulation& system, double t, const std::function<bool()>& go_on,
                        const std::function<void()>& see);

// The numbers of the present state that the problem compares.
std::vector<double> compared(const Problem& problem, Simulation& system);

// The free coordinates of the present state, 3 a free particle in m, or all components of a
// first-order state.
std::vector<double> coordinates(Simulation& system);

// The free coordinates of a list of all coordinates, as SystemSpec::exact gives them. Throws
// Error{kScene} if it has another length.
std::vector<double> free_coordinates(Simulation& system, const std::vector<double>& all);

struct Distance {
  double rms = 0, most = 0;  // over the coordinates, in their unit
  int where = 0;             // the coordinate of `most`
};
Distance distance(const std::vector<double>& a, const std::vector<double>& b);

// The diagonal of the box around the initial state, in m; the size of a flat state. 1 for a point.
double scene_size(const Simulation& system);

}  // namespace sim::study
