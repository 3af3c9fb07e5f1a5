// The finer runs that follow one that missed an error.
#pragma once

#include <cmath>
#include <optional>

#include "core/study/accuracy/trial_run.h"

namespace sim::study {

inline constexpr double kAim = 0.7;            // of the error allowed
inline constexpr double kMostTimesFiner = 64;  // at once

// How fine the next run is, by how the errors of those before it fell.
class Mending {
 public:
  struct Limits {
    double allowed = 0;           // error
    double enough = 0;            // fineness with which a trial has kept it; 0: none has
    double finest = HUGE_VAL;     // fineness beyond which trials tell nothing
    double most_cost = HUGE_VAL;  // of a run, evaluations
  };
  // exponent: with which errors are expected to fall.
  Mending(const Refinement& refinement, double exponent, const Limits& limits)
      : refinement_(refinement), limits_(limits), exponent_(exponent) {}

  // The fineness of the run after one of that fineness, error and cost; empty if none is worth it.
  // Where errors no longer fall, it may cost `free` at most.
  std::optional<double> after(double fineness, double error, double cost, double free);

  double exponent() const { return exponent_; }  // with which errors fell
  double cost() const { return cost_; }          // that the last answer is expected to have

 private:
  Refinement refinement_;
  Limits limits_;
  double exponent_, cost_ = 0;
  double fineness_ = 0, error_ = 0;  // of the run before; 0: there is none
};

}  // namespace sim::study
