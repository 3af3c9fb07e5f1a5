#include "core/study/accuracy/order.h"

#include <algorithm>
#include <cmath>

namespace sim::study {
namespace {

constexpr SweepLimits kOrderLimits{.evaluations = 5e5, .implicit_cost = 100, .seconds = 1.5};

bool adaptive(const Candidate& method) { return method.info.adaptive && method.has_tolerance; }

// Halving until the error sinks below what the reference knows. Nothing when told to end.
std::optional<std::vector<Point>> halve(const Problem& problem, const Candidate& method,
                                        const Yardstick& yardstick, double most_evaluations,
                                        const std::function<bool()>& go_on) {
  std::vector<Point> points;
  const int cost = kOrderLimits.cost_of_step(method);
  double tolerance = 1e-3;
  for (std::int64_t steps = kIntervals; static_cast<double>(steps) * cost <= most_evaluations;) {
    const auto point =
        measure(problem, method, steps, adaptive(method) ? tolerance : 0, yardstick, go_on);
    if (!point) return {};
    points.push_back(*point);
    if (point->finished && point->rms <= yardstick.floor()) break;
    if (point->seconds > kOrderLimits.seconds ||
        (adaptive(method) && tolerance < std::max(2e-13, 2 * method.least_tolerance)))
      break;
    adaptive(method) ? tolerance /= 10 : steps *= 2;
  }
  return points;
}

}  // namespace

// Steps are halved, so that all runs of a method take twice the last.
double longest(const Problem& problem, const OrderOptions& options) {
  constexpr double kRuns = 2, kReference = 2.5e6;
  Simulation system = problem.simulation();
  const auto methods =
      static_cast<double>(methods_to_sweep(problem, system, options.integrators).size());
  const double reference = kReference * 64 / std::max(64, system.particles());
  return seconds_an_evaluation(system) *
         (reference + kRuns * methods * kOrderLimits.evaluations_for(system));
}

std::unique_ptr<OrderStudy> order(const Problem& problem, const OrderOptions& options,
                                  const Watch& watch) {
  auto study = std::make_unique<OrderStudy>();
  const Simulation system = problem.simulation();
  const std::vector<Candidate> methods = methods_to_sweep(problem, system, options.integrators);
  study->system = system.name();
  study->unit = system.flat() ? "" : "m";
  study->time = options.time > 0 ? options.time : std::min(system.duration(), 1.0);
  if (!(study->time > 0)) study->time = 1;
  study->size = scene_size(system);
  study->reference = reference(problem, study->time, watch);
  study->yardstick = {
      &study->reference, study->time, study->size, study->reference.intervals(), false, 0};
  if (study->reference.points.empty()) {
    study->complete = false;
    return study;
  }
  const double most = kOrderLimits.evaluations_for(system);
  for (const Candidate& method : methods) {
    const auto done =
        static_cast<double>(study->methods.size()) / static_cast<double>(methods.size());
    const Yardstick yardstick = study->yardstick.of(method);
    auto points = halve(problem, method, yardstick, most,
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
