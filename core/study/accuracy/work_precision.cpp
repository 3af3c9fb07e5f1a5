#include "core/study/accuracy/work_precision.h"

#include <algorithm>
#include <cmath>

#include "core/math/elementary.h"
#include "core/study/accuracy/cost_estimate.h"
#include "core/study/limits/step_limit.h"

namespace sim::study {

bool on_front(const WorkPrecision& study, Place place) {
  return std::ranges::any_of(study.front, [&](Place each) {
    return each.curve == place.curve && each.point == place.point;
  });
}

bool stable(const Point& point, double size) { return point.finished && point.rms < size; }

namespace {

constexpr double kFirstOfCurve = 1e-2, kLastOfCurve = 0.99e-12;
constexpr SweepLimits kCurveLimits{.evaluations = 5e4, .implicit_cost = 50, .seconds = 0.5};

// 20 intervals of 1, 2, 3, 4, 6, 8, 12, 16, ... steps: either they all coincide with points of the
// reference, or include all of these.
std::vector<std::int64_t> step_counts(double most) {
  std::vector<std::int64_t> counts;
  for (std::int64_t each = kIntervals; static_cast<double>(each) <= most; each *= 2) {
    counts.push_back(each);
    if (each > kIntervals && 1.5 * static_cast<double>(each) <= most)
      counts.push_back(each / 2 * 3);
  }
  return counts;
}

// False if told to end; the curve has the points so far.
bool sweep(const Problem& problem, const Yardstick& yardstick, double most_evaluations,
           Curve& curve, const std::function<bool()>& go_on) {
  const Candidate& method = curve.method;
  std::vector<Point>& points = curve.points;
  const bool by_tolerance = method.info.adaptive && method.has_tolerance;
  const int cost = kCurveLimits.cost_of_step(method);
  const auto run = [&](std::int64_t steps, double tolerance) {
    Patience patience(kCurveLimits, go_on);
    const auto point =
        measure(problem, method, steps, tolerance, yardstick, [&] { return patience.ask(); });
    if (point) points.push_back(*point);
    curve.late = !point && patience.late();
    return point.has_value();
  };
  const auto finest = [&] {
    const Point& last = points.back();
    const auto known = [&](const Point& p) { return p.finished && p.rms <= yardstick.floor(); };
    // A figure may be right by chance.
    const bool enough = !yardstick.figure || (points.size() > 1 && known(points.end()[-2]));
    const bool long_enough = last.seconds > kCurveLimits.seconds;
    curve.late = long_enough;
    return long_enough || (known(last) && enough);
  };
  if (by_tolerance) {
    for (int digits = 2;; ++digits) {
      const double tolerance = elementary::pow(10.0, -digits);
      if (tolerance < std::max(kLastOfCurve, 0.99 * method.least_tolerance)) break;
      if (!run(kIntervals, tolerance)) return curve.late;
      if (finest()) break;
    }
    return true;
  }
  for (const std::int64_t steps : step_counts(most_evaluations / cost)) {
    if (!run(steps, 0)) return curve.late;
    if (finest()) return true;
  }
  curve.late = true;
  return true;
}

bool in_single(const Curve& curve) { return curve.method.info.precision == Precision::kSingle; }

// The cost of explicit methods is their evaluations. The additional work of implicit ones, and the
// savings of single precision, are measured by time, in units of the time of an evaluation in the
// explicit runs in double precision.
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

// Below its floor the reference is as inaccurate as the point: such points are left out unless
// `all` are wanted.
std::vector<Place> by_cost(const WorkPrecision& study, bool all) {
  std::vector<Place> positions;
  for (std::size_t c = 0; c < study.curves.size(); ++c)
    for (std::size_t p = 0; p < study.curves[c].points.size(); ++p) {
      const Point& point = study.curves[c].points[p];
      if (stable(point, study.size) &&
          (all || study.yardstick.figure || point.rms > study.yardstick.floor()))
        positions.push_back({c, p});
    }
  std::stable_sort(positions.begin(), positions.end(), [&](Place a, Place b) {
    return study.cost(a) != study.cost(b) ? study.cost(a) < study.cost(b)
                                          : study.at(a).rms < study.at(b).rms;
  });
  return positions;
}

// A figure may be right by chance: no error is taken to be below the largest of finer steps.
void believe_no_luck(std::vector<Point>& points) {
  double worst = 0;
  for (auto point = points.rbegin(); point != points.rend(); ++point) {
    if (!point->finished) continue;
    worst = point->rms = std::max(worst, point->rms);
  }
}

// True well inside the stability limit: up to 0.8 of it, or 0.5 for long undamped runs, which
// suffer from nonlinear resonance (Skeel & Srinivas 2000).
bool well_inside(const WorkPrecision& study, Place place) {
  const Curve& curve = study.curves[place.curve];
  if (!curve.limit || curve.method.info.adaptive) return true;
  const bool long_undamped =
      study.fastest.damping <= 0 && study.time * study.fastest.omega > 2 * M_PI * 1e3;
  return study.at(place).dt <= (long_undamped ? 0.5 : 0.8) * *curve.limit;
}

}  // namespace

double WorkPrecision::needed() const { return budget / (yardstick.figure ? 4 : 100); }

void choose(WorkPrecision& study) {
  if (study.yardstick.figure)
    for (Curve& curve : study.curves) believe_no_luck(curve.points);
  price(study.curves);
  double best = HUGE_VAL;
  for (const Place place : by_cost(study, false)) {
    const double error = study.at(place).rms;
    if (error < best) study.front.push_back(place);
    best = std::min(best, error);
  }
  recommend(study);
}

// A choice that costs little more and is closer is the better one.
void recommend(WorkPrecision& study) {
  constexpr double kLittleMore = 1.05;
  study.cheapest = study.recommended = {};
  double most = HUGE_VAL;
  for (const Place place : by_cost(study, study.yardstick.floor() <= study.budget)) {
    const double error = study.at(place).rms;
    const bool refused = std::ranges::any_of(study.refused, [&](Place each) {
      return each.curve == place.curve && each.point >= place.point;
    });
    if (error > study.budget || refused) continue;
    if (!study.cheapest) study.cheapest = place;
    if (!well_inside(study, place) || study.cost(place) > most) continue;
    if (!study.recommended) most = kLittleMore * study.cost(place);
    if (!study.recommended || error < study.at(*study.recommended).rms) study.recommended = place;
  }
}

namespace {

// The size to which a rounding error at the start has grown at a point of the reference.
double grown_rounding(const WorkPrecision& study, std::size_t k) {
  const auto each = static_cast<std::size_t>(std::max(1, study.reference.intervals() / kIntervals));
  const std::size_t measured = (k + each - 1) / each;
  const double grown = measured < study.growth.most.size() ? study.growth.most[measured] : 0;
  return kRoundingSeed * study.size * grown;
}

}  // namespace

int last_comparable(const WorkPrecision& study) {
  int last = 0;
  for (std::size_t k = 1; k < study.reference.points.size(); ++k) {
    const bool known =
        study.reference.error[k] <= study.needed() && grown_rounding(study, k) <= study.needed();
    if (!known) break;
    last = static_cast<int>(k);
  }
  return last;
}

bool grows_too_far(const WorkPrecision& study) {
  const auto next = static_cast<std::size_t>(study.yardstick.last) + 1;
  return next < study.reference.points.size() && grown_rounding(study, next) > study.needed();
}

namespace {

double time_of(const Simulation& system, const WorkPrecisionOptions& options) {
  return options.time > 0 ? options.time : system.duration() > 0 ? system.duration() : 1;
}

std::vector<Candidate> methods_of(const Problem& problem, const Simulation& system,
                                  const WorkPrecisionOptions& options) {
  std::vector<Candidate> methods = methods_to_sweep(problem, system, options.integrators);
  // Methods that choose among the others would only show them twice.
  if (options.integrators.empty())
    std::erase_if(methods, [](const Candidate& method) { return method.chooses; });
  return methods;
}

}  // namespace

double expected(const Problem& problem, const WorkPrecisionOptions& options) {
  Simulation system = problem.simulation();
  const std::vector<Candidate> methods = methods_of(problem, system, options);
  const CostEstimate pace = cost_estimate(problem, methods, time_of(system, options));
  double sum = pace.reference(reference_intervals(problem, system), problem.by_figure());
  for (const Candidate& method : methods) {
    const double most = kCurveLimits.evaluations_for(system) / kCurveLimits.cost_of_step(method);
    sum += method.info.adaptive && method.has_tolerance
               ? pace.tolerances(method, kFirstOfCurve, kLastOfCurve, kCurveLimits, options.repeats)
               : pace.steps(method, step_counts(most), kCurveLimits, options.repeats);
  }
  return sum;
}

std::unique_ptr<WorkPrecision> work_precision(const Problem& problem,
                                              const WorkPrecisionOptions& options,
                                              const Watch& watch) {
  auto study = std::make_unique<WorkPrecision>();
  Simulation system = problem.simulation();
  study->system = system.name();
  study->time = time_of(system, options);
  study->size = scene_size(system);
  study->complete = false;
  study->unit = problem.of || system.flat() ? "" : "m";
  const std::vector<Candidate> methods = methods_of(problem, system, options);
  study->reference = reference(problem, study->time, watch);
  if (study->reference.points.empty()) return study;
  if (problem.of) study->size = range_of(problem, study->reference);
  study->budget = options.budget * (options.budget_in_metres ? 1 : study->size);
  // The growth of perturbations does not apply to a quantity of the scene's own.
  if (problem.of)
    study->growth.complete = true;
  else
    study->growth = growth(problem, study->reference, study->time, watch);
  const Spectrum modes = spectrum(system);
  study->fastest = modes.fastest;
  study->yardstick = {&study->reference, study->time, study->size,        0, true,
                      options.repeats,   0,           problem.by_figure()};
  const int last = study->yardstick.last = last_comparable(*study);
  const int whole = study->reference.intervals();
  study->comparable = last == whole ? study->time : study->time * last / whole;
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
    study->complete = sweep(problem, yardstick, most, curve,
                            [&] { return watch(method.label, 0.3 + 0.7 * done); });
    curve.observed = observed_order(curve.points, yardstick);
    if (!study->complete) break;
  }
  choose(*study);
  return study;
}

}  // namespace sim::study
