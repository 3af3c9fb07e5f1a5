// One run of a method at a fineness, what is seen of it, and the errors between two of them.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/study/accuracy/trajectory.h"

namespace sim::study {

// The states of a run at equal intervals of time, and its cost.
struct SeenRun {
  std::vector<std::vector<double>> points;  // the compared quantities, at k time / intervals
  double cost = 0;                          // in evaluations of f, see cost_of()
  bool finished = false;
  bool acted_at_ends = false;    // contact that a run with other ends of steps has elsewhere
  double figure = std::nan("");  // if the problem asks for one
};

// The cost in evaluations, including the equations of implicit steps: a fixed price for an
// iteration and a factorisation, so that a choice by cost is the same on every machine.
double cost_of(const Effort& effort);

// The errors of a run at common times, against another one. For a figure a single one at the end.
struct ErrorCourse {
  std::vector<double> rms;       // at k time / (size - 1); infinite where one run did not get
  double most = 0, largest = 0;  // the largest rms, and of any particle (or number)
};
ErrorCourse error_course(const Problem& problem, const SeenRun& run, const SeenRun& other);

// The exponent with which errors fall: below it, finer runs come no closer.
inline constexpr double kLeastExponent = 0.3;
inline constexpr double kFinestTolerance = 1e-13;  // that a method is run with

// The way in which a method is refined: by its steps, or by its tolerance.
class Refinement {
 public:
  explicit Refinement(const Candidate& method)
      : by_tolerance_((method.info.adaptive || method.chooses) && method.has_tolerance),
        order_(std::max(1, method.info.order)) {}

  bool by_tolerance() const { return by_tolerance_; }
  double factor() const { return by_tolerance_ ? 10 : 2; }
  // The claimed exponents: error = C fineness^-error(), cost = C fineness^cost(); fineness is the
  // number of steps, or 1 / tolerance.
  double error() const { return by_tolerance_ ? 1 : order_; }
  double cost() const { return by_tolerance_ ? 1.0 / order_ : 1; }
  double dearer() const;  // how many times the cost of a run its refinement costs

 private:
  bool by_tolerance_;
  int order_;
};

// A run of `time` seconds, at a fineness. Steps are rounded up to a multiple that is sampled.
struct TrialRun {
  std::int64_t steps = 0;  // between states; of its own size for a method of fixed steps
  double tolerance = 0;    // 0 for those
};
// `between`: steps between states for a method with a tolerance. A method whose states are
// corrected at their ends (contact) has more of them with a smaller tolerance.
TrialRun trial_run(const Candidate& method, double fineness, std::int64_t between);
// The same, finer by Refinement::factor().
TrialRun refined(const TrialRun& run, bool corrected);

// Is called with the share of a run that is done; false ends it.
using RunWatch = std::function<bool(double done)>;

// A changed run starts that share of the size away, or half a step early, so that its steps end
// between the others.
struct RunChange {
  double disturbed = 0;
  bool shifted = false;
};
SeenRun seen_run(const Problem& problem, const Candidate& method, const TrialRun& run, double time,
                 const RunWatch& go_on, const RunChange& change = {});

// The share of a course of errors, at equal times, before the first that is beyond the one allowed.
double kept_share(std::span<const double> course, double allowed);

}  // namespace sim::study
