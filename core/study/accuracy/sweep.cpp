#include "core/study/accuracy/sweep.h"

#include <algorithm>
#include <cmath>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/base/stopwatch.h"
#include "core/math/elementary.h"

namespace sim::study {
namespace {

// Slope and offset of y over x by least squares.
ObservedOrder fit(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double mx = 0, my = 0, sxx = 0, sxy = 0, rest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    sxx += (x[i] - mx) * (x[i] - mx);
    sxy += (x[i] - mx) * (y[i] - my);
  }
  ObservedOrder result;
  result.slope = sxy / sxx;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double off = y[i] - my - result.slope * (x[i] - mx);
    rest += off * off;
  }
  result.standard_error = std::sqrt(rest / (n - 2) / sxx);
  result.constant = elementary::exp(my - result.slope * mx);
  result.points = static_cast<int>(x.size());
  return result;
}

}  // namespace

double SweepLimits::evaluations_for(const Simulation& system) const {
  return evaluations * 64 / std::max(64, system.particles());
}

int SweepLimits::cost_of_step(const Candidate& method) const {
  return method.info.implicit ? implicit_cost : std::max(1, method.info.evaluations);
}

double seconds_an_evaluation(Simulation& system) {
  constexpr double kLong = 2e-3;
  Array x(system.state().size()), rate(x.size());
  const Stopwatch watch;
  for (int count = 1;; ++count) {
    system.ode().eval(system.t(), {system.state().data(), {}}, x.data(), rate.data());
    if (const double seconds = watch.seconds(); seconds > kLong) return seconds / count;
  }
}

double Yardstick::floor() const {
  double most = 0;
  for (int k = 0; k <= last; ++k)
    most = std::max(most, reference->error[static_cast<std::size_t>(k)]);
  return std::max(figure ? most : 10 * most, rounding);
}

Yardstick Yardstick::of(const Candidate& method) const {
  Yardstick result = *this;
  if (method.info.precision != Precision::kSingle) return result;
  // The rounding errors of coordinates; smaller steps only add to them.
  double largest = 0;
  for (const double coordinate : reference->points.front())
    largest = std::max(largest, std::abs(coordinate));
  result.rounding = 8 * 0x1p-24 * std::max(size, largest);
  return result;
}

std::vector<Candidate> methods_to_sweep(const Problem& problem, const Simulation& run,
                                        const std::vector<MethodChoice>& choices) {
  constexpr const char* kTolerances[] = {"tol", "rtol", "atol"};
  MethodChoice own = problem.integrator();
  if (run.integrator_info().adaptive)
    for (const char* name : kTolerances) own.given.erase(name);
  const std::vector<Candidate> methods = fitting_methods(problem.with(own), choices);
  for (const Candidate& method : methods)
    for (const char* name : kTolerances)
      if (method.info.adaptive && method.given.contains(name))
        throw Error(ErrorKind::kUsage,
                    {"a tolerance for '" + method.label + "'", "on the command line",
                     "the study chooses tolerances itself", std::string("leave ") + name + " out"});
  return methods;
}

int repeats_after(double seconds, int wanted) {
  return std::min(wanted, seconds > 0.1 ? 0 : seconds > 0.02 ? 3 : wanted);
}

bool has_dense_output(const IntegratorInfo& info, bool contact) {
  return info.adaptive && !(info.implicit && contact);
}

std::optional<Point> measure(const Problem& problem, const Candidate& method, std::int64_t steps,
                             double tolerance, const Yardstick& yardstick,
                             const std::function<bool()>& go_on) {
  const Reference& reference = *yardstick.reference;
  const bool by_tolerance = tolerance > 0;
  bool told = false;
  const auto watched = [&] {
    told = told || !go_on();
    return !told;
  };
  Point point;
  TrajectoryPlan plan{yardstick.time, reference.seen_of(steps), steps, tolerance, yardstick.energy};
  const bool dense = has_dense_output(method.info, reference.contact);
  if (by_tolerance && dense) plan.steps = plan.intervals = reference.adaptive_intervals();
  const int stride = reference.intervals() / plan.intervals;
  Course course;
  plan.see = [&](int k, const std::vector<double>& x) {
    if (k * stride > yardstick.last) return;
    if (yardstick.figure) return course.look(yardstick.time * k / plan.intervals, x.front());
    const Distance d = distance(x, reference.points[static_cast<std::size_t>(k * stride)]);
    if (!(d.rms <= point.rms)) point.rms = d.rms;
    point.rms_end = d.rms;
    point.most_end = d.most;
    point.worst = d.where;
  };
  const Trajectory run = run_trajectory(problem, method, plan, watched);
  if (told) return {};
  if (yardstick.figure)
    point.rms = point.rms_end = point.most_end =
        std::max(std::abs(course.figure(*problem.of) - reference.figure), yardstick.floor());

  point.dt = yardstick.time / static_cast<double>(steps);
  point.tolerance = tolerance;
  point.finished = run.finished && std::isfinite(point.rms);
  point.energy = run.energy_error;
  point.drift = run.drift;
  point.seconds = run.seconds;
  point.steps = run.effort.steps > 0 ? run.effort.steps : run.steps;
  point.effort = run.effort;

  plan = {yardstick.time, kIntervals, steps, tolerance, false};
  std::vector<double> seconds;
  const int repeats = repeats_after(run.seconds, yardstick.repeats);
  for (int repeat = 0; repeat < repeats && point.finished; ++repeat) {
    seconds.push_back(run_trajectory(problem, method, plan, watched).seconds);
    if (told) return {};
  }
  std::sort(seconds.begin(), seconds.end());
  if (!seconds.empty()) {
    point.seconds = seconds[seconds.size() / 2];
    point.spread = seconds.back() - seconds.front();
  }
  return point;
}

// The longest sequence of points whose local orders agree; of two the finer one.
std::optional<ObservedOrder> observed_order(const std::vector<Point>& points,
                                            const Yardstick& yardstick) {
  // Steps chosen by a tolerance vary more than halved ones.
  const double spread = !points.empty() && points.front().tolerance > 0 ? 1.5 : 0.3;
  std::vector<double> x, y;
  for (const Point& point : points) {
    const bool fits =
        point.finished && point.rms > 10 * yardstick.floor() && point.rms < 1e-2 * yardstick.size;
    const double step = elementary::log(
        point.tolerance > 0 ? yardstick.time / static_cast<double>(point.steps) : point.dt);
    // Tolerances below a limit of the step all take the same steps.
    if (!fits || (!x.empty() && x.back() == step)) continue;
    x.push_back(step);
    y.push_back(elementary::log(point.rms));
  }
  std::size_t best_begin = 0, best_length = 0;
  for (std::size_t begin = 0; begin + 2 < x.size(); ++begin) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t end = begin + 1; end < x.size(); ++end) {
      const double local = (y[end] - y[end - 1]) / (x[end] - x[end - 1]);
      low = std::min(low, local);
      high = std::max(high, local);
      if (!(high - low < spread)) break;
      if (end - begin + 1 < best_length) continue;
      best_begin = begin;
      best_length = end - begin + 1;
    }
  }
  if (best_length < 3) return {};
  const auto part = [&](const std::vector<double>& v) {
    const auto first = v.begin() + static_cast<std::ptrdiff_t>(best_begin);
    return std::vector<double>(first, first + static_cast<std::ptrdiff_t>(best_length));
  };
  return fit(part(x), part(y));
}

}  // namespace sim::study
