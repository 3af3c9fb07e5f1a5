// A run and its refined run, and the errors that these and other runs show.
#pragma once

#include <cmath>

#include "core/study/accuracy/trial_run.h"

namespace sim::study {

class CheckedRun {
 public:
  // time: of the run, s. allowed: error. spent: evaluations, to which those of its runs are added.
  // The problem, the method and that sum outlive it.
  CheckedRun(const Problem& problem, const Candidate& method, const TrialRun& plan, double time,
             double allowed, double& spent)
      : problem_(problem),
        method_(method),
        plan_(plan),
        time_(time),
        allowed_(allowed),
        spent_(spent) {}

  // These run it; false if `go_on` ended that.
  bool run(const RunWatch& go_on) { return see(plan_, go_on, {}, run_); }
  bool refine(bool corrected, const RunWatch& go_on) {
    return see(refined(plan_, corrected), go_on, {}, fine_);
  }
  // A third run whose steps end between those of the others, which share the ends at which contact
  // acts and springs break.
  bool run_between(const RunWatch& go_on);
  // True if a neighbour of the refined run, a hundred-millionth of `size` away, diverges from it as
  // far as chaos takes it; false if `go_on` ended its run, or the refined run failed.
  bool is_chaotic(bool corrected, double size, const RunWatch& go_on);

  // The errors by the refined run, where errors fall by `falls` from one to the other.
  void compare(double falls);
  // True if another run, which is right within `error`, differs by more than both may.
  bool contradicts(const SeenRun& other, double error) const;
  void believe(const SeenRun& other, double error);  // that one

  const Candidate& method() const { return method_; }
  const TrialRun& plan() const { return plan_; }
  const SeenRun& seen() const { return run_; }
  const SeenRun& fine() const { return fine_; }
  double error() const { return error_; }      // the largest rms, as far as is known
  double largest() const { return largest_; }  // of any particle (or number)
  // Until the last state before the error is beyond the one allowed, s; infinite if it never is.
  double horizon() const { return horizon_; }
  bool kept() const { return error_ <= allowed_; }
  double check_cost() const { return cost_ - run_.cost; }  // of all runs but the first, evaluations

 private:
  bool see(const TrialRun& plan, const RunWatch& go_on, const RunChange& change, SeenRun& to);
  double kept_until(const ErrorCourse& course, double allowed) const;
  void worsen(const ErrorCourse& course, double times, double allowed);

  const Problem& problem_;
  const Candidate& method_;
  TrialRun plan_;
  double time_, allowed_;
  double& spent_;
  SeenRun run_, fine_;
  double cost_ = 0, error_ = 0, largest_ = 0, horizon_ = HUGE_VAL;
};

}  // namespace sim::study
