#include "core/study/accuracy/method_trials.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/math/elementary.h"
#include "core/study/accuracy/perturbation_growth.h"

namespace sim::study {
namespace {

constexpr std::int64_t kSeenWhole = 5000;   // steps of a run that is seen at each of them
constexpr std::int64_t kSights = 120;       // of a longer run, at most; and at least:
constexpr std::int64_t kFewestSights = 20;  // a divisor of it
constexpr double kMostSeenNumbers = 4e6;    // kept of a run
constexpr double kImplicitStep = 50;        // evaluations that one is worth before it is tried
constexpr double kLeastExponent = 0.3;
constexpr double kFinestTolerance = 1e-13;

// Errors may have narrow peaks in time, as stiff parts pass others: all steps are seen where that
// takes little memory.
std::int64_t sights(const Problem& problem, const Simulation& system, std::int64_t steps) {
  const double numbers =
      problem.of ? 1 : static_cast<double>(std::max<std::size_t>(1, system.state().size()));
  const bool all = steps <= kSeenWhole && static_cast<double>(steps) * numbers <= kMostSeenNumbers;
  if (all || problem.by_figure()) return steps;
  std::int64_t most = kSights;
  while (most > kFewestSights && static_cast<double>(most) * numbers > kMostSeenNumbers)
    most = most > 60 ? 60 : kFewestSights;
  return std::gcd(steps, most);
}

}  // namespace

double cost_of(const Effort& effort) {
  constexpr double kNewton = 4, kFactorisation = 50, kLinear = 3;
  return static_cast<double>(effort.evaluations) + kNewton * static_cast<double>(effort.newton) +
         kFactorisation * static_cast<double>(effort.factorisations) +
         kLinear * static_cast<double>(effort.linear);
}

ErrorCourse error_course(const Problem& problem, const SeenRun& run, const SeenRun& other) {
  ErrorCourse course;
  if (problem.by_figure()) {
    const double off = std::abs(run.figure - other.figure);
    course.most = course.largest = std::isfinite(off) ? off : HUGE_VAL;
    course.rms = {0, course.most};
    return course;
  }
  const auto intervals = [](const SeenRun& each) { return each.points.size() - 1; };
  // A run that ended early counts as infinitely far from the other.
  if (!run.finished || !other.finished) {
    course.most = course.largest = HUGE_VAL;
    course.rms = {0, HUGE_VAL};
    return course;
  }
  const std::size_t common = std::gcd(intervals(run), intervals(other));
  const bool flat = problem.of || problem.spec->first_order;
  for (std::size_t k = 0; k <= common; ++k) {
    const std::vector<double>& a = run.points[k * (intervals(run) / common)];
    const std::vector<double>& b = other.points[k * (intervals(other) / common)];
    const Distance d = distance(a, b);
    const double rms = std::isfinite(d.rms) ? d.rms : HUGE_VAL;
    course.rms.push_back(rms);
    course.most = std::max(course.most, rms);
    for (std::size_t i = 0; i < a.size(); i += flat ? 1 : 3) {
      double square = 0;
      for (std::size_t j = i; j < std::min(a.size(), i + (flat ? 1 : 3)); ++j)
        square += (a[j] - b[j]) * (a[j] - b[j]);
      course.largest = std::max(course.largest, std::sqrt(square));
    }
  }
  return course;
}

TrialRun trial_run(const Candidate& method, double fineness, std::int64_t between) {
  if (Refinement(method).by_tolerance())
    return {between, std::max({1 / fineness, kFinestTolerance, method.least_tolerance})};
  const std::int64_t wanted = static_cast<std::int64_t>(std::ceil(fineness * (1 - 1e-12)));
  const std::int64_t each = wanted < 240 ? kFewestSights : wanted < 1200 ? 60 : kSights;
  return {(wanted + each - 1) / each * each, 0};
}

TrialRun refined(const TrialRun& run, bool corrected) {
  if (run.tolerance == 0) return {2 * run.steps, 0};
  return {corrected ? 2 * run.steps : run.steps, run.tolerance / 10};
}

SeenRun seen_run(const Problem& problem, const Candidate& method, const TrialRun& run, double time,
                 const std::function<bool()>& go_on, std::optional<double> disturbed) {
  SeenRun result;
  TrajectoryPlan plan{.time = time, .steps = run.steps, .tolerance = run.tolerance};
  plan.intervals =
      static_cast<int>(sights(problem, problem.with(method).simulation(time), run.steps));
  Course course;
  plan.see = [&](int k, const std::vector<double>& x) {
    if (problem.by_figure())
      course.look(time * k / plan.intervals, x.front());
    else
      result.points.push_back(x);
  };
  if (disturbed)
    plan.begin = [&](Simulation& system) {
      Snapshot start = system.snapshot();
      disturb(system, *disturbed, 0, start.x);
      start.memory.clear();
      system.restore(start);
    };
  const Trajectory path = run_trajectory(problem, method, plan, go_on);
  result.finished = path.finished;
  result.cost = cost_of(path.effort);
  if (problem.by_figure()) result.figure = course.figure(*problem.of);
  return result;
}

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

bool MethodTrials::can_refine() const {
  if (given_up_ || (only_ && runs_ == 2)) return false;
  return !refinement_.by_tolerance() || fineness_ < 0.9 / kFinestTolerance;
}

bool MethodTrials::refine(const std::function<bool()>& go_on) {
  const double factor = refinement_.factor();
  const double finer = runs_ == 0 ? first_ : factor * fineness_;
  TrialRun plan = trial_run(method_, finer, between_);
  if (refinement_.by_tolerance() && corrected_) plan.steps = between_ << runs_;
  bool told = false;
  SeenRun next = seen_run(*problem_, method_, plan, window_, [&] {
    told = told || !go_on();
    return !told;
  });
  if (told) return false;
  ++runs_;
  spent_ += next.cost;
  doubt_ = 0;
  coarse_error_ = error_;
  if (runs_ > 1) {
    const ErrorCourse course = error_course(*problem_, finest_, next);
    const double claimed = refinement_.error();
    const double ratio = elementary::log(difference_ / course.most) / elementary::log(factor);
    if (std::isfinite(difference_) && course.most > 0)
      exponent_ = std::clamp(ratio, kLeastExponent, claimed);
    idle_ = std::isfinite(difference_) && ratio < kLeastExponent;
    difference_ = course.most;
    const double falls = elementary::pow(factor, -exponent_);
    coarse_error_ = course.most / (1 - falls);
    course_ = course.rms;
    for (double& each : course_) each /= 1 - falls;
    error_ = coarse_error_ * falls;
  }
  next_cost_ = cost_ > 0 && next.finished && finest_.finished
                   ? next.cost * std::clamp(next.cost / cost_, 1.0, factor)
                   : next.cost * elementary::pow(factor, refinement_.cost());
  if (!next.finished) next_cost_ = std::max(next_cost_, factor * next.cost);
  cost_ = next.cost;
  fineness_ = finer;
  finest_ = std::move(next);
  return true;
}

double kept_share(std::span<const double> course, double allowed) {
  const auto missed =
      std::ranges::find_if(course, [&](double error) { return !(error <= allowed); });
  if (course.size() < 2) return 0;
  return static_cast<double>(std::max<std::ptrdiff_t>(0, missed - course.begin() - 1)) /
         static_cast<double>(course.size() - 1);
}

CostPrediction MethodTrials::predict(double allowed) const {
  if (only_) {
    if (runs_ < 2 || !(std::max(coarse_error_, doubt_) <= allowed)) return {};
    return {first_, cost_ / elementary::pow(refinement_.factor(), refinement_.cost())};
  }
  if (!std::isfinite(error()) || doubt_ > allowed) return {};
  const double times =
      error_ > 0 ? elementary::pow(error_ / allowed, 1 / exponent_) : 1 / refinement_.factor();
  const double fineness = std::max(first_, fineness_ * times);
  const double slope = elementary::log(next_cost_ / cost_) / elementary::log(refinement_.factor());
  return {fineness, cost_ * elementary::pow(fineness / fineness_, slope)};
}

double MethodTrials::least_cost(double allowed) const {
  if (!std::isfinite(error_)) return next_cost_ / refinement_.factor();
  if (error_ <= allowed) return predict(allowed).cost;
  const double times = elementary::pow(error_ / allowed, 1 / refinement_.error());
  return cost_ * elementary::pow(times, refinement_.cost());
}

}  // namespace sim::study
