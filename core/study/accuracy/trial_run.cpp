#include "core/study/accuracy/trial_run.h"

#include <algorithm>
#include <numeric>

#include "core/math/elementary.h"
#include "core/study/accuracy/perturbation_growth.h"

namespace sim::study {
namespace {

constexpr std::int64_t kSeenWhole = 5000;   // steps of a run that is seen at each of them
constexpr std::int64_t kSights = 120;       // of a longer run, at most; and at least:
constexpr std::int64_t kFewestSights = 20;  // a divisor of it
constexpr double kMostSeenNumbers = 4e6;    // kept of a run

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

double Refinement::dearer() const { return elementary::pow(factor(), cost()); }

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
                 const RunWatch& go_on, const RunChange& change) {
  SeenRun result;
  TrajectoryPlan plan{.time = time, .steps = run.steps, .tolerance = run.tolerance};
  plan.intervals =
      static_cast<int>(sights(problem, problem.with(method).simulation(time), run.steps));
  Course course;
  double done = 0;
  plan.see = [&](int k, const std::vector<double>& x) {
    done = static_cast<double>(k) / plan.intervals;
    if (problem.by_figure())
      course.look(time * k / plan.intervals, x.front());
    else
      result.points.push_back(x);
  };
  plan.shifted = change.shifted;
  if (change.disturbed > 0)
    plan.begin = [&](Simulation& system) {
      Snapshot start = system.snapshot();
      disturb(system, change.disturbed, 0, start.x);
      start.memory.clear();
      system.restore(start);
    };
  const Trajectory path = run_trajectory(problem, method, plan, [&] { return go_on(done); });
  result.finished = path.finished;
  result.acted_at_ends = path.acted.broke || path.acted.at_ends(method.info.adaptive);
  result.cost = cost_of(path.effort);
  if (problem.by_figure()) result.figure = course.figure(*problem.of);
  return result;
}

double kept_share(std::span<const double> course, double allowed) {
  const auto missed =
      std::ranges::find_if(course, [&](double error) { return !(error <= allowed); });
  if (course.size() < 2) return 0;
  return static_cast<double>(std::max<std::ptrdiff_t>(0, missed - course.begin() - 1)) /
         static_cast<double>(course.size() - 1);
}

}  // namespace sim::study
