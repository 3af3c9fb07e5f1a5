// Two methods' finest trials, compared at each time of their window.
#pragma once

#include <vector>

#include "core/study/accuracy/method_trials.h"

namespace sim::study {

// Times the sum of both errors that two families may differ.
inline constexpr double kFamiliesAgree = 2;

// True if one of the two is implicit, or splits its steps, and the other does not.
bool other_family(const Candidate& a, const Candidate& b);

class TrialPair {
 public:
  TrialPair(const Problem& problem, const MethodTrials& a, const MethodTrials& b)
      : a_(&a), b_(&b), off_(error_course(problem, a.finest(), b.finest())) {}

  double apart() const { return off_.most; }
  // At no time do both differ by more than their errors until then, or what is negligible: a run
  // that has lost its way explains nothing of what happened before.
  bool agree(double negligible) const;
  // The most by which they differ beyond what `known`, one of them, knows of its own error.
  double beyond(const MethodTrials& known) const;
  // The share of the window over which both keep the error, and agree.
  double kept_share(double allowed) const;

 private:
  double share(std::size_t k) const {
    return off_.rms.size() < 2 ? 1
                               : static_cast<double>(k) / static_cast<double>(off_.rms.size() - 1);
  }

  const MethodTrials *a_, *b_;
  ErrorCourse off_;
};

// The method that keeps the error longest: as another family confirms, or any other method, or by
// itself. None if no error is known.
MethodTrials* longest_kept(const Problem& problem, std::vector<MethodTrials>& trials,
                           double allowed);

}  // namespace sim::study
