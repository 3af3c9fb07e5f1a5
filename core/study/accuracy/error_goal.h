// A required error instead of a step: the method and the step that keep it are found by trials and
// checked over the whole run.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/study/accuracy/method_trials.h"
#include "core/study/budget.h"

namespace sim::study {

struct ErrorGoal {
  Budget budget;    // of the largest rms error of all times
  double time = 0;  // s, of the run
  // That may be chosen; none, or one that chooses among others: all that fit.
  std::vector<MethodChoice> integrators = {};
  double dt = 0;      // s, that must be taken; 0 = any
  bool asked = true;  // false: a run that is not expected to keep it is not mended
};

// The cost at which a method would keep the error, by its trials.
struct GoalCandidate {
  std::string label;
  double cost = HUGE_VAL;  // evaluations of the whole run; infinite: it does not keep it
  double order = 0;        // observed
  int runs = 0;
  std::string why;  // it was not followed further
};

struct GoalChoice {
  std::string system, unit;   // of errors: "m", or nothing for numbers
  double time = 0, size = 1;  // s; m, or the range of a quantity
  double allowed = 0;         // in the unit
  double window = 0;          // s, the part of the run that the trials took
  std::optional<Candidate> method;
  double dt = 0, tolerance = 0;           // s; 0 for methods without one
  std::vector<GoalCandidate> candidates;  // cheapest first

  // The error of the chosen run, from a run with half its step, or a tenth of its tolerance.
  double error = std::nan(""), largest = std::nan("");  // rms, and of any particle
  double cost = 0;                // evaluations, implicit equations at a fixed price, see cost_of()
  double cost_of_ten = HUGE_VAL;  // the cheapest that keeps ten times the error
  double check = 0;               // cost of the runs that check the chosen one
  double trials = 0;              // cost of all others, and of trials that were given up
  int mended = 0;                 // how often a run missed and a finer one was taken
  bool kept = false;
  bool asked = true;                // see RequiredError
  bool from_scene = false;          // trials told too little: the scene's own method and step
  double horizon = HUGE_VAL;        // s, until when it is kept
  bool chaotic = false;             // neighbours part, so that no step helps
  bool complete = false;            // false: told to end
  double missed_at = std::nan("");  // s, of a pulse of a force that no step of the run has seen

  // The run as a user would ask for it.
  MethodChoice integrator() const;
  // The run has gone past a pulse at that time, s: the error is known until then.
  void miss_pulse(double t);
};

// Throws Error{kUsage} if no method is left to choose from.
GoalChoice choose_for_error(const Problem& problem, const ErrorGoal& goal, const Watch& watch);

}  // namespace sim::study
