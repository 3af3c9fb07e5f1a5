#include "core/study/accuracy/method_trials.h"

#include <algorithm>
#include <utility>

#include "core/math/elementary.h"

namespace sim::study {
namespace {

constexpr double kImplicitStep = 50;  // evaluations that one is worth before it is tried
constexpr double kCoarsestTolerance = 1e-2;

}  // namespace

MethodTrials::MethodTrials(const Problem& problem, Candidate method, double window, double first,
                           std::int64_t between, bool corrected, bool only)
    : problem_(&problem),
      method_(std::move(method)),
      refinement_(method_),
      window_(window),
      first_(first),
      between_(between),
      corrected_(corrected),
      only_(only),
      exponent_(refinement_.error()) {
  const double step = method_.info.implicit ? kImplicitStep : std::max(1, method_.info.evaluations);
  const auto steps = static_cast<double>(trial_run(method_, first, between).steps);
  next_cost_ = refinement_.by_tolerance() && !method_.info.implicit
                   ? step * std::max(20.0, steps / 10)
                   : step * steps;
}

void MethodTrials::doubt_coarse_runs(double error) {
  doubt_ = error;
  first_ = refinement_.factor() * fineness_;
}

bool MethodTrials::can_refine() const {
  if (given_up_ || (only_ && runs_ == 2)) return false;
  return !refinement_.by_tolerance() || fineness_ < 0.9 / kFinestTolerance;
}

bool MethodTrials::refine(const RunWatch& go_on) {
  const double factor = refinement_.factor();
  const double finer = runs_ == 0 ? first_ : factor * fineness_;
  TrialRun plan = trial_run(method_, finer, between_);
  if (refinement_.by_tolerance() && corrected_) plan.steps = between_ << runs_;
  bool told = false;
  SeenRun next = seen_run(*problem_, method_, plan, window_, [&](double done) {
    told = told || !go_on(done);
    return !told;
  });
  if (told) return false;
  ++runs_;
  spent_ += next.cost;
  doubt_ = 0;
  if (runs_ > 1) {
    const ErrorCourse course = error_course(*problem_, finest_, next);
    const double claimed = refinement_.error();
    const double ratio = elementary::log(difference_ / course.most) / elementary::log(factor);
    if (std::isfinite(difference_) && course.most > 0)
      exponent_ = std::clamp(ratio, kLeastExponent, claimed);
    idle_ = std::isfinite(difference_) && ratio < kLeastExponent;
    difference_ = course.most;
    const double falls = elementary::pow(factor, -exponent_);
    course_ = course.rms;
    for (double until = 0; double& each : course_)
      until = each = std::max(each / (1 - falls), until);
    coarser_.push_back({fineness_, course.most / (1 - falls)});
    error_ = coarse_error() * falls;
  }
  next_cost_ = cost_ > 0 && next.finished && finest_.finished
                   ? next.cost * std::clamp(next.cost / cost_, 1.0, factor)
                   : next.cost * refinement_.dearer();
  // A method with a tolerance that could not go on tells little of what it takes with a smaller
  // one.
  if (!next.finished && !refinement_.by_tolerance())
    next_cost_ = std::max(next_cost_, factor * next.cost);
  cost_ = next.cost;
  fineness_ = finer;
  finest_ = std::move(next);
  return true;
}

double MethodTrials::error_until(double share) const {
  if (course_.empty() || !std::isfinite(error_)) return error();
  const double last = share * (static_cast<double>(course_.size()) - 1);
  const double most = course_[static_cast<std::size_t>(std::ceil(last))];
  return std::max(most > 0 ? error_ / coarse_error() * most : 0, doubt_);
}

CostPrediction MethodTrials::predict(double allowed) const {
  if (only_) {
    if (runs_ < 2 || !(std::max(coarse_error(), doubt_) <= allowed)) return {};
    return {first_, cost_ / refinement_.dearer()};
  }
  if (!std::isfinite(error()) || doubt_ > allowed) return {};
  const double times =
      error_ > 0 ? elementary::pow(error_ / allowed, 1 / exponent_) : 1 / refinement_.factor();
  double fineness = std::max(first_, fineness_ * times);
  // Runs that missed the error tell more than the order of those that follow.
  for (const Tried& run : coarser_)
    if (run.error > allowed)
      fineness = std::max(
          fineness, run.fineness * std::min(elementary::pow(run.error / allowed, 1 / exponent_),
                                            refinement_.factor()));
  return {fineness, cost_at(fineness)};
}

double MethodTrials::cost_at(double fineness) const {
  if (runs_ == 0) return next_cost_ * elementary::pow(fineness / first_, refinement_.cost());
  const double slope = elementary::log(next_cost_ / cost_) / elementary::log(refinement_.factor());
  return cost_ * elementary::pow(fineness / fineness_, slope);
}

bool MethodTrials::can_coarsen(double allowed) const {
  if (only_ || runs_ < 2 || doubt_ > 0 || !refinement_.by_tolerance()) return false;
  const double coarser = first_ / refinement_.factor();
  return coarser > 0.9 / kCoarsestTolerance && predict(allowed).fineness <= first_ &&
         error_ * elementary::pow(fineness_ / coarser, exponent_) <= allowed;
}

void MethodTrials::coarsen(double allowed, const RunWatch& go_on) {
  const double coarser = first_ / refinement_.factor();
  const SeenRun run =
      seen_run(*problem_, method_, trial_run(method_, coarser, between_), window_, go_on);
  spent_ += run.cost;
  if (error_course(*problem_, finest_, run).most + error_ <= allowed) first_ = coarser;
}

double MethodTrials::least_cost(double allowed) const {
  if (!std::isfinite(error_)) return next_cost_ / refinement_.factor();
  if (error_ <= allowed) return predict(allowed).cost;
  const double times = elementary::pow(error_ / allowed, 1 / refinement_.error());
  return cost_ * elementary::pow(times, refinement_.cost());
}

}  // namespace sim::study
