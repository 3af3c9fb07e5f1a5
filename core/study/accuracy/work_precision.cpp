#include "core/study/accuracy/work_precision.h"

#include <algorithm>
#include <cmath>

#include "core/study/limits/step_limit.h"

namespace sim::study {

bool stable(const Point& point, double size) { return point.finished && point.rms < size; }

namespace {

constexpr SweepLimits kCurveLimits{.evaluations = 5e4, .implicit_cost = 50, .seconds = 0.5};

// 20 intervals of 1, 2, 3, 4, 6, 8, 12, 16, ... steps: all of them points of the reference, or all
// points of the reference among them.
std::vector<std::int64_t> step_counts(double most) {
  std::vector<std::int64_t> counts;
  for (std::int64_t each = kIntervals; static_cast<double>(each) <= most; each *= 2) {
    counts.push_back(each);
    if (each > kIntervals && 1.5 * static_cast<double>(each) <= most)
      counts.push_back(each / 2 * 3);
  }
  return counts;
}

// Nothing when told to end; the points so far are then in `points`.
bool sweep(const Problem& problem, const Candidate& method, const Yardstick& yardstick,
           double most_evaluations, std::vector<Point>& points,
           const std::function<bool()>& go_on) {
  const bool by_tolerance = method.info.adaptive && method.has_tolerance;
  const int cost = kCurveLimits.cost_of_step(method);
  const auto run = [&](std::int64_t steps, double tolerance) {
    const auto point = measure(problem, method, steps, tolerance, yardstick, go_on);
    if (point) points.push_back(*point);
    return point.has_value();
  };
  const auto finest = [&] {
    const Point& last = points.back();
    return last.seconds > kCurveLimits.seconds || (last.finished && last.rms <= yardstick.floor());
  };
  if (by_tolerance) {
    for (int digits = 2; digits <= 12; ++digits) {
      const double tolerance = std::pow(10.0, -digits);
      if (tolerance < 0.99 * method.least_tolerance) break;
      if (!run(kIntervals, tolerance)) return false;
      if (finest()) break;
    }
    return true;
  }
  for (const std::int64_t steps : step_counts(most_evaluations / cost)) {
    if (!run(steps, 0)) return false;
    if (finest()) break;
  }
  return true;
}

bool in_single(const Curve& curve) { return curve.method.info.precision == Precision::kSingle; }

// Explicit methods cost their evaluations. What an implicit one does besides, and what single
// precision saves, is counted by the time it takes, in units of the time that an evaluation takes
// in the explicit runs in double precision.
void price(std::vector<Curve>& curves) {
  std::vector<double> each;
  for (const Curve& curve : curves)
    for (const Point& point : curve.points)
      if (!curve.method.info.implicit && !in_single(curve) && point.finished &&
          point.effort.evaluations >= 200)
        each.push_back(point.seconds / static_cast<double>(point.effort.evaluations));
  std::sort(each.begin(), each.end());
  const double second = each.empty() ? 0 : each[each.size() / 2];
  for (Curve& curve : curves) {
    curve.cost.clear();
    for (const Point& point : curve.points) {
      const auto evaluations = static_cast<double>(point.effort.evaluations);
      const double time = second > 0 ? point.seconds / second : evaluations;
      curve.cost.push_back(curve.method.info.implicit ? std::max(evaluations, time)
                           : in_single(curve)         ? std::min(evaluations, time)
                                                      : evaluations);
    }
  }
}

std::vector<Place> by_cost(const WorkPrecision& study) {
  std::vector<Place> places;
  for (std::size_t c = 0; c < study.curves.size(); ++c)
    for (std::size_t p = 0; p < study.curves[c].points.size(); ++p) {
      const Point& point = study.curves[c].points[p];
      // Below the floor the reference is as wrong as the point.
      if (stable(point, study.size) && point.rms > study.yardstick.floor())
        places.push_back({c, p});
    }
  std::stable_sort(places.begin(), places.end(), [&](Place a, Place b) {
    return study.cost(a) != study.cost(b) ? study.cost(a) < study.cost(b)
                                          : study.at(a).rms < study.at(b).rms;
  });
  return places;
}

// Inside the limit of stability with room to spare: 0.8 of it, and 0.5 for long runs that nothing
// damps, where nonlinear resonance eats at them (Skeel & Srinivas 2000).
bool well_inside(const WorkPrecision& study, Place place) {
  const Curve& curve = study.curves[place.curve];
  if (!curve.limit || curve.method.info.adaptive) return true;
  const bool long_undamped =
      study.fastest.damping <= 0 && study.time * study.fastest.omega > 2 * M_PI * 1e3;
  return study.at(place).dt <= (long_undamped ? 0.5 : 0.8) * *curve.limit;
}

}  // namespace

// What costs little more and is closer is the better choice.
void choose(WorkPrecision& study) {
  constexpr double kLittleMore = 1.05;
  price(study.curves);
  double best = HUGE_VAL, most = HUGE_VAL;
  for (const Place place : by_cost(study)) {
    const double error = study.at(place).rms;
    if (error < best) study.front.push_back(place);
    best = std::min(best, error);
    if (error > study.budget) continue;
    if (!study.cheapest) study.cheapest = place;
    if (!well_inside(study, place) || study.cost(place) > most) continue;
    if (!study.recommended) most = kLittleMore * study.cost(place);
    if (!study.recommended || error < study.at(*study.recommended).rms) study.recommended = place;
  }
}

int last_comparable(const WorkPrecision& study) {
  int last = 0;
  const int each = std::max(1, study.reference.intervals() / kIntervals);
  for (std::size_t k = 1; k < study.reference.points.size(); ++k) {
    const std::size_t measured =
        (k + static_cast<std::size_t>(each) - 1) / static_cast<std::size_t>(each);
    const double grown = measured < study.growth.most.size() ? study.growth.most[measured] : 0;
    const bool known = study.reference.error[k] <= study.budget / 100 &&
                       kRoundingSeed * study.size * grown <= study.budget / 100;
    if (!known) break;
    last = static_cast<int>(k);
  }
  return last;
}

namespace {

// Of the quantity that is compared; its size where it never changes.
double range(const std::vector<std::vector<double>>& points) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const auto& point : points) {
    low = std::min(low, point.front());
    high = std::max(high, point.front());
  }
  if (high > low) return high - low;
  return std::abs(high) > 0 ? std::abs(high) : 1;
}

std::vector<Candidate> methods_of(const Problem& problem, const Simulation& system,
                                  const WorkPrecisionOptions& options) {
  std::vector<Candidate> methods = methods_to_sweep(problem, system, options.integrators);
  // What chooses among the others would only show them twice.
  if (options.integrators.empty())
    std::erase_if(methods, [](const Candidate& method) { return method.chooses; });
  return methods;
}

}  // namespace

// The runs of a method are at most 3.4 times as long as its last, and each is timed some times.
double longest(const Problem& problem, const WorkPrecisionOptions& options) {
  constexpr double kRuns = 3.4, kReference = 1e7, kOverhead = 2;
  Simulation system = problem.simulation();
  const auto methods = static_cast<double>(methods_of(problem, system, options).size());
  const double each = kCurveLimits.evaluations_for(system);
  const double sweeps = methods * kRuns * each * (1 + options.repeats);
  const double reference = kReference * 64 / std::max(64, system.particles()) / 4;
  return kOverhead * seconds_an_evaluation(system) * (reference + sweeps);
}

std::unique_ptr<WorkPrecision> work_precision(const Problem& problem,
                                              const WorkPrecisionOptions& options,
                                              const Watch& watch) {
  auto study = std::make_unique<WorkPrecision>();
  Simulation system = problem.simulation();
  study->system = system.name();
  study->time = options.time > 0 ? options.time : system.duration() > 0 ? system.duration() : 1;
  study->size = scene_size(system);
  study->complete = false;
  study->unit = problem.of || system.flat() ? "" : "m";
  const std::vector<Candidate> methods = methods_of(problem, system, options);
  study->reference = reference(problem, study->time, watch);
  if (study->reference.points.empty()) return study;
  if (problem.of) study->size = range(study->reference.points);
  study->budget = options.budget * (options.budget_in_metres ? 1 : study->size);
  // How positions part says nothing of a quantity of the scene's own.
  if (problem.of)
    study->growth.complete = true;
  else
    study->growth = growth(problem, study->reference, study->time, watch);
  const Spectrum modes = spectrum(system);
  study->fastest = modes.fastest;
  const int last = last_comparable(*study);
  study->comparable = study->time * last / study->reference.intervals();
  study->yardstick = {&study->reference, study->time, study->size, last, true, options.repeats};
  if (last == 0) {
    study->complete = study->growth.complete;
    return study;
  }

  const double most = kCurveLimits.evaluations_for(system);
  study->complete = true;
  for (const Candidate& method : methods) {
    const auto done =
        static_cast<double>(study->curves.size()) / static_cast<double>(methods.size());
    Curve& curve = study->curves.emplace_back();
    curve.method = method;
    curve.limit = predicted_step(*problem.with(method).make_integrator(), modes);
    const Yardstick yardstick = study->yardstick.of(method);
    study->complete = sweep(problem, method, yardstick, most, curve.points,
                            [&] { return watch(method.label, 0.3 + 0.7 * done); });
    curve.observed = observed_order(curve.points, yardstick);
    if (!study->complete) break;
  }
  choose(*study);
  return study;
}

}  // namespace sim::study
