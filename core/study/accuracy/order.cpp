#include "core/study/accuracy/order.h"

#include <algorithm>
#include <cmath>

#include "core/study/accuracy/cost_estimate.h"

namespace sim::study {
namespace {

constexpr SweepLimits kOrderLimits{.evaluations = 5e5, .implicit_cost = 100, .seconds = 1.5};

bool adaptive(const Candidate& method) { return method.info.adaptive && method.has_tolerance; }

constexpr double kFirstTolerance = 1e-3, kLastTolerance = 2e-13;

std::vector<std::int64_t> halved(const Simulation& system, const Candidate& method) {
  const double most = kOrderLimits.evaluations_for(system);
  const int cost = kOrderLimits.cost_of_step(method);
  std::vector<std::int64_t> counts;
  for (std::int64_t steps = kIntervals; static_cast<double>(steps) * cost <= most; steps *= 2)
    counts.push_back(steps);
  return counts;
}

double time_of(const Simulation& system, const OrderOptions& options) {
  const double time = options.time > 0 ? options.time : std::min(system.duration(), 1.0);
  return time > 0 ? time : 1;
}

// Halves the step until the error sinks below that of the reference. Empty if told to end.
std::optional<std::vector<Point>> halve(const Problem& problem, const Candidate& method,
                                        const Yardstick& yardstick,
                                        std::span<const std::int64_t> counts,
                                        const std::function<bool()>& go_on) {
  std::vector<Point> points;
  double tolerance = kFirstTolerance;
  for (std::size_t k = 0; adaptive(method) || k < counts.size();) {
    const std::int64_t steps = adaptive(method) ? kIntervals : counts[k];
    Patience patience(kOrderLimits, go_on);
    const auto point = measure(problem, method, steps, adaptive(method) ? tolerance : 0, yardstick,
                               [&] { return patience.ask(); });
    if (!point && patience.late()) break;
    if (!point) return {};
    points.push_back(*point);
    if (point->finished && point->rms <= yardstick.floor()) break;
    if (point->seconds > kOrderLimits.seconds ||
        (adaptive(method) && tolerance < std::max(kLastTolerance, 2 * method.least_tolerance)))
      break;
    tolerance /= 10;
    ++k;
  }
  return points;
}

}  // namespace

double expected(const Problem& problem, const OrderOptions& options) {
  Simulation system = problem.simulation();
  const std::vector<Candidate> methods = methods_to_sweep(problem, system, options.integrators);
  const CostEstimate pace = cost_estimate(problem, methods, time_of(system, options));
  double sum = pace.reference(reference_intervals(problem, system), problem.by_figure());
  for (const Candidate& method : methods)
    sum += adaptive(method)
               ? pace.tolerances(method, kFirstTolerance, kLastTolerance, kOrderLimits, 0)
               : pace.steps(method, halved(system, method), kOrderLimits, 0);
  return sum;
}

std::unique_ptr<OrderStudy> order(const Problem& problem, const OrderOptions& options,
                                  const Watch& watch) {
  auto study = std::make_unique<OrderStudy>();
  const Simulation system = problem.simulation();
  const std::vector<Candidate> methods = methods_to_sweep(problem, system, options.integrators);
  study->system = system.name();
  study->unit = problem.of || system.flat() ? "" : "m";
  study->time = time_of(system, options);
  study->size = scene_size(system);
  study->reference = reference(problem, study->time, watch);
  study->yardstick = {
      &study->reference, study->time, study->size, study->reference.intervals(), false, 0};
  study->yardstick.figure = problem.by_figure();
  if (study->reference.points.empty()) {
    study->complete = false;
    return study;
  }
  if (problem.of) study->size = study->yardstick.size = range_of(problem, study->reference);
  for (const Candidate& method : methods) {
    const auto done =
        static_cast<double>(study->methods.size()) / static_cast<double>(methods.size());
    const Yardstick yardstick = study->yardstick.of(method);
    auto points = halve(problem, method, yardstick, halved(system, method),
                        [&] { return watch(method.label, 0.2 + 0.8 * done); });
    if (!points) {
      study->complete = false;
      return study;
    }
    const auto observed = observed_order(*points, yardstick);
    study->methods.push_back({method, std::move(*points), observed});
  }
  return study;
}

bool keeps_order(const MethodOrder& method) {
  const double slack = adaptive(method.method) ? 0.7 : method.method.info.order >= 6 ? 0.3 : 0.15;
  return method.observed && method.observed->slope > method.method.info.order - slack;
}

}  // namespace sim::study
