#include "core/study/accuracy/cost_estimate.h"

#include <algorithm>
#include <cmath>

#include "core/base/stopwatch.h"
#include "core/math/elementary.h"

namespace sim::study {
namespace {

constexpr double kFinest = 1e-11;     // of the size: about the accuracy of a reference
constexpr double kImplicitCost = 40;  // evaluations that the time of an implicit step is worth
constexpr double kWatched = 1.5;      // times as long takes a run whose states are looked at
constexpr double kPilot = 2e5;        // evaluations of 64 particles, or as many as take
constexpr double kPilotSeconds = 0.2;
constexpr double kMostSeconds = 2;  // of all pilot runs: contact and constraints take longer

double with_repeats(double seconds, int repeats) {
  return seconds * (kWatched + repeats_after(seconds, repeats));
}

}  // namespace

std::optional<double> seconds_a_step(const Problem& problem, const Candidate& method) {
  constexpr double kLong = 0.03;
  constexpr int kSteps = 20;
  Simulation system = problem.with(method).simulation();
  const Stopwatch watch;
  for (int step = 1; step <= kSteps && system.step(); ++step) {
    const double seconds = watch.seconds();
    const auto own = static_cast<double>(system.integrator().effort().steps);
    if (step == kSteps || seconds > kLong) return seconds / std::max<double>(step, own);
  }
  return {};
}

double CostEstimate::step(const Candidate& method) const {
  if (!method.info.implicit) return seconds * std::max(1, method.info.evaluations);
  const auto known = implicit.find(method.label);
  return known == implicit.end() ? kImplicitCost * seconds : known->second;
}

double CostEstimate::steps_to(const Candidate& method, double error) const {
  return time * rate * elementary::pow(error, -1.0 / std::max(1, method.info.order));
}

double CostEstimate::steps(const Candidate& method, std::span<const std::int64_t> counts,
                           const SweepLimits& limits, int repeats) const {
  const double enough = steps_to(method, kFinest);
  double sum = 0;
  for (const std::int64_t count : counts) {
    const double each = static_cast<double>(count) * step(method);
    sum += with_repeats(each, repeats);
    if (static_cast<double>(count) >= enough || each > limits.seconds) break;
  }
  return sum;
}

double CostEstimate::tolerances(const Candidate& method, double first, double last,
                                const SweepLimits& limits, int repeats) const {
  double sum = 0;
  for (double tolerance = first; tolerance >= last; tolerance /= 10) {
    const double each = steps_to(method, tolerance) * step(method);
    sum += with_repeats(each, repeats);
    if (each > limits.seconds) break;
  }
  return sum;
}

double CostEstimate::reference(int points, bool by_figure) const {
  constexpr double kExtrapolation = 20, kChecks = 40;  // evaluations a point
  constexpr double kRadian = 60;                       // evaluations, of all of them together
  const double path = std::max(kExtrapolation * points, kRadian * time * rate);
  return seconds * (path * (by_figure ? 5 : 1) + kChecks * points);
}

CostEstimate cost_estimate(const Problem& problem, std::span<const Candidate> methods,
                           double time) {
  Simulation system = problem.simulation();
  CostEstimate pace{time, seconds_an_evaluation(system), 1 / time, {}};
  for (const Candidate& method : methods)
    if (const auto known = method.info.implicit ? seconds_a_step(problem, method) : std::nullopt)
      pace.implicit[method.label] = *known;
  const auto fixed = std::ranges::find_if(methods, [](const Candidate& method) {
    return !method.info.implicit && !method.info.adaptive && !method.chooses &&
           method.info.order >= 2 && method.info.precision == Precision::kDouble;
  });
  if (fixed == methods.end()) return pace;
  const double most = std::min(kPilot * 64 / std::max(64, system.particles()),
                               kPilotSeconds / std::max(1e-9, pace.seconds)) /
                      std::max(1, fixed->info.evaluations);
  const double h = std::min(system.h(), time / kIntervals);
  const double part = std::min(time, most * h);
  const Stopwatch watch;
  auto steps = std::max<std::int64_t>(kIntervals, static_cast<std::int64_t>(part / h));
  for (int attempt = 0; attempt < 3 && watch.seconds() < kMostSeconds; ++attempt, steps *= 2) {
    std::vector<double> ends[2];
    Trajectory runs[2];
    for (const int k : {0, 1})
      runs[k] = run_trajectory(problem, *fixed,
                               {.time = part,
                                .intervals = 1,
                                .steps = steps << k,
                                .see = [&](int, const std::vector<double>& x) { ends[k] = x; }},
                               [&] { return watch.seconds() < kMostSeconds; });
    if (!runs[1].finished) continue;
    const double size = problem.of ? std::max(1e-3, std::abs(ends[1].front())) : scene_size(system);
    const double off = std::clamp(distance(ends[0], ends[1]).rms / size, 1e-14, 1.0);
    pace.rate = elementary::pow(off, 1.0 / fixed->info.order) * static_cast<double>(steps) / part;
    const double measured =
        runs[1].seconds / std::max<double>(1, static_cast<double>(runs[1].effort.evaluations));
    pace.seconds = std::max(measured, 1e-9);
    break;
  }
  return pace;
}

}  // namespace sim::study
