// One method tried at smaller and smaller steps, or tolerances, each run compared with the next.
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

SeenRun seen_run(const Problem& problem, const Candidate& method, const TrialRun& run, double time,
                 const std::function<bool()>& go_on, std::optional<double> disturbed = {});

// The share of a course of errors, at equal times, before the first that is beyond the one allowed.
double kept_share(std::span<const double> course, double allowed);

struct CostPrediction {
  double fineness = 0, cost = HUGE_VAL;  // of the window
};

class MethodTrials {
 public:
  // Trials in the first `window` seconds; `first` is the initial fineness. With `only` no other
  // method is allowed, and one refinement determines its error.
  MethodTrials(const Problem& problem, Candidate method, double window, double first,
               std::int64_t between, bool corrected, bool only);

  const Candidate& method() const { return method_; }
  double next_cost() const { return next_cost_; }   // of the next refinement, about
  bool refine(const std::function<bool()>& go_on);  // false: told to end
  bool can_refine() const;
  void give_up() { given_up_ = true; }  // no more runs

  // The error of the finest run is infinite before there are two.
  double error() const { return std::max(error_, doubt_); }
  double own_error() const { return error_; }    // whatever another family says
  void doubt(double error) { doubt_ = error; }   // another family says so; until it is refined
  double exponent() const { return exponent_; }  // observed, at most the claimed one
  // The share of the window over which the run before the finest kept it.
  double kept_share(double allowed) const { return study::kept_share(course_, allowed); }
  const SeenRun& finest() const { return finest_; }
  double fineness() const { return fineness_; }
  // True if the last refinement brought its run no closer, so that no order predicts the next.
  bool idle() const { return idle_; }
  // The fineness of the coarser of the last two runs that keeps the error, as far as is known; else
  // infinite.
  double kept_at(double allowed) const {
    if (!(error() <= allowed)) return HUGE_VAL;
    const bool coarse = std::max(coarse_error_, doubt_) <= allowed;
    return coarse ? fineness_ / refinement_.factor() : fineness_;
  }
  double spent() const { return spent_; }
  int runs() const { return runs_; }

  // The cheapest run that keeps this error, as far as the measurements tell.
  CostPrediction predict(double allowed) const;
  // A lower bound on the cost of a run that keeps it, if the claimed order holds from the finest
  // run on.
  double least_cost(double allowed) const;

 private:
  const Problem* problem_;
  Candidate method_;
  Refinement refinement_;
  double window_, first_;
  std::int64_t between_;
  bool corrected_, only_, given_up_ = false, idle_ = false;
  double fineness_ = 0;  // of the finest run
  double cost_ = 0, next_cost_, spent_ = 0;
  double error_ = HUGE_VAL, coarse_error_ = HUGE_VAL, doubt_ = 0, exponent_, difference_ = HUGE_VAL;
  int runs_ = 0;
  SeenRun finest_;
  std::vector<double> course_;  // the error of the run before it, at equal times
};

}  // namespace sim::study
