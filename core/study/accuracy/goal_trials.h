// The trials with which the choice for an error begins.
#pragma once

#include <vector>

#include "core/study/accuracy/error_goal.h"
#include "core/study/accuracy/method_trials.h"

namespace sim::study {

inline constexpr double kFirstGoalTolerance = 1e-3;  // of trials
inline constexpr double kInPulse = 4;                // steps in the shortest pulse, at least

class GoalTrials {
 public:
  // The problem and the goal outlive it.
  GoalTrials(const Problem& problem, const ErrorGoal& goal);

  double step() const { return step_; }          // s, that the scene or the goal asks for
  double pulse() const { return pulse_; }        // s, the shortest
  bool corrected() const { return corrected_; }  // states, at ends of steps

  // The number of states that a method with adaptive steps shows: as many as the scene asks for,
  // but few for an implicit method without dense output, as each state ends a step.
  std::int64_t states_in(const Candidate& method, double time) const;
  // All methods that may be chosen take part, in the first `window` seconds.
  std::vector<MethodTrials> of(double window) const;

 private:
  std::vector<Candidate> methods(Simulation& system) const;

  const Problem& problem_;
  const ErrorGoal& goal_;
  double step_ = 0, pulse_ = 0;
  bool corrected_ = false;
};

}  // namespace sim::study
