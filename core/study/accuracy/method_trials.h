// One method tried at smaller and smaller steps, or tolerances, each run compared with the next.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/study/accuracy/trial_run.h"

namespace sim::study {

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
  double next_cost() const { return next_cost_; }  // of the next refinement, about
  bool refine(const RunWatch& go_on);              // false: told to end
  bool can_refine() const;
  void give_up() { given_up_ = true; }  // no more runs

  // The error of the finest run is infinite before there are two.
  double error() const { return std::max(error_, doubt_); }
  double error_until(double share) const;       // of the window; error() at 1
  double own_error() const { return error_; }   // whatever another family says
  void doubt(double error) { doubt_ = error; }  // another family says so; until it is refined
  // The same, and runs as coarse as the finest are not chosen later.
  void doubt_coarse_runs(double error);
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
    const bool coarse = std::max(coarse_error(), doubt_) <= allowed;
    return coarse ? fineness_ / refinement_.factor() : fineness_;
  }
  double spent() const { return spent_; }
  int runs() const { return runs_; }

  // The cheapest run that keeps this error, as far as the measurements tell.
  CostPrediction predict(double allowed) const;
  double cost_at(double fineness) const;  // of such a run, as far as they tell
  // A lower bound on the cost of a run that keeps it, if the claimed order holds from the finest
  // run on.
  double least_cost(double allowed) const;

  // True if the first run was so far within the error that one with a larger tolerance may keep it.
  bool can_coarsen(double allowed) const;
  // Tries that one, which may be chosen from then on if it keeps the error.
  void coarsen(double allowed, const RunWatch& go_on);

 private:
  struct Tried {
    double fineness, error;
  };
  double coarse_error() const { return coarser_.empty() ? HUGE_VAL : coarser_.back().error; }

  const Problem* problem_;
  Candidate method_;
  Refinement refinement_;
  double window_, first_;  // of which no coarser run is chosen
  std::int64_t between_;
  bool corrected_, only_, given_up_ = false, idle_ = false;
  double fineness_ = 0;  // of the finest run
  double cost_ = 0, next_cost_, spent_ = 0;
  double error_ = HUGE_VAL, doubt_ = 0, exponent_, difference_ = HUGE_VAL;
  int runs_ = 0;
  SeenRun finest_;
  std::vector<Tried> coarser_;  // the runs before it
  std::vector<double> course_;  // the largest error of the run before it until then, at equal times
};

}  // namespace sim::study
