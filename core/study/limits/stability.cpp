#include "core/study/limits/stability.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/base/stopwatch.h"
#include "core/base/text.h"
#include "core/study/accuracy/cost_estimate.h"
#include "core/study/accuracy/sweep.h"
#include "core/study/energy_balance.h"
#include "core/study/limits/disturbance.h"
#include "core/study/limits/step_limit.h"

namespace sim::study {
namespace {

constexpr double kFractions[] = {0.25, 0.5, 0.9, 1.1};
constexpr double kInfinity = HUGE_VAL;

constexpr double kPatience = 10;  // s, with the measured limit of one method

// A study that takes much longer than estimated skips the rest: the estimate is made at the start,
// where contact may not have begun.
constexpr double kMostTimes = 3, kLeastOverrun = 2;  // of the estimate, and s

bool bounded(const std::optional<double>& limit) {
  return limit && *limit > 0 && *limit < kInfinity;
}

int cost_of_step(const Candidate& method) {
  constexpr int kImplicit = 50;  // evaluations that an implicit step is worth
  return method.info.implicit ? kImplicit : std::max(1, method.info.evaluations);
}

// The number of steps of one run that is affordable.
double affordable_steps(const Simulation& system, const Candidate& method) {
  constexpr double kMostWork = 1e7;  // evaluations, of all particles together
  const double most =
      kMostWork / cost_of_step(method) / std::max(64, system.particles() + system.components() / 6);
  return system.second_order() ? most : 0.1 * most;
}

// The result of a step that failed; empty if the study was told to end.
std::optional<EnergyAtStep> failed_at(double fraction, double dt,
                                      const std::function<bool()>& go_on,
                                      double error = kInfinity) {
  if (!go_on()) return {};
  return EnergyAtStep{fraction, dt, error};
}

// The energy after a run with this step; empty if told to end.
std::optional<EnergyAtStep> energy_at(const Problem& problem, double fraction, double dt,
                                      double time, const std::function<bool()>& go_on) {
  Simulation run = problem.simulation(dt);
  run.stop_when([&] { return !go_on(); });
  EnergyBalance balance(run);
  const auto steps = static_cast<std::int64_t>(std::ceil(time / dt / 2)) * 2;
  for (std::int64_t i = 0; i < steps; ++i) {
    if (i % 32 == 0 && !go_on()) return {};
    if (!run.step()) return failed_at(fraction, dt, go_on);
    balance.advance();
    balance.look();
  }
  if (balance.in_play() == 0) return EnergyAtStep{fraction, dt, 0};
  const double relative = std::abs(balance.error()) / balance.in_play();
  return EnergyAtStep{fraction, dt, std::isnan(relative) ? kInfinity : relative};
}

double largest_difference(std::span<const double> a, std::span<const double> b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = larger_error(std::abs(a[i] - b[i]), most);
  return most;
}

// The error of a run of a first-order system: its distance from a run with a tenth of the step,
// relative to the largest number on the way. Empty if told to end.
std::optional<EnergyAtStep> error_at(const Problem& problem, double fraction, double dt,
                                     double time, const std::function<bool()>& go_on) {
  constexpr int kFiner = 10;
  Simulation run = problem.simulation(dt), fine = problem.simulation(dt / kFiner);
  for (Simulation* each : {&run, &fine}) each->stop_when([&] { return !go_on(); });
  const auto steps = static_cast<std::int64_t>(std::ceil(time / dt));
  double most = 0, size = 0;
  for (std::int64_t i = 0; i < steps; ++i) {
    if (i % 32 == 0 && !go_on()) return {};
    if (!run.step()) return failed_at(fraction, dt, go_on);
    for (int k = 0; k < kFiner; ++k)
      if (!fine.step()) return failed_at(fraction, dt, go_on, std::nan(""));
    for (const double value : fine.state()) size = std::max(size, std::abs(value));
    most = std::max(most, largest_difference(run.state(), fine.state()));
    if (!(most <= 1e3 * size)) return EnergyAtStep{fraction, dt, kInfinity};
  }
  return EnergyAtStep{fraction, dt, size > 0 ? most / size : 0};
}

// The duration of the scene; without one, a multiple of the largest step.
double energy_time(const Simulation& system, const std::vector<MethodStability>& methods) {
  double largest = 0;
  for (const MethodStability& each : methods)
    if (bounded(step_limit(each))) largest = std::max(largest, *step_limit(each));
  constexpr double kFirstOrder = 400;  // steps of the largest limit, enough to show the behaviour
  const double duration = system.duration() > 0 ? system.duration() : 100 * largest;
  return system.second_order() ? duration : std::min(duration, kFirstOrder * largest);
}

// Methods that accept only springs and drag do not fit a system held at rest by loads.
void measure_limit(Standstill& place, const Stability& result, MethodStability& each) try {
  // If the fastest mode grows by itself, growth does not come from the step.
  if (result.spectrum.first_order && result.spectrum.fastest.damping < 0) return;
  if (result.spectrum.fastest.omega > 0) {
    each.radius = MeasuredRadius(place, result.spectrum, each.method)(result.dt);
    if (place.system().second_order() && !each.method.info.implicit) {
      const double grown = Disturbance(place, result.spectrum, each.method)(result.dt);
      if (grown > 1 + Disturbance::kTolerance) each.radius = std::max(*each.radius, grown);
    }
  }
  each.measured = measured_step(place, result.spectrum, each.method);
  // If damping barely holds a growth that is too slow to measure, only the prediction is known.
  if (each.measured == 0.0 && each.predicted.value_or(0) > 0) each.measured.reset();
  // Steps in the plane of the fastest mode confirm the limit of a flat system at most: another mode
  // may be the first to grow, and a state that moves on is another one by the end of a step.
  constexpr double kConfirms = 0.05;
  if (result.spectrum.first_order && each.measured && each.predicted &&
      !(*each.measured >= (1 - kConfirms) * *each.predicted &&
        *each.measured <= (1 + kConfirms) * *each.predicted))
    each.measured.reset();
} catch (const Error&) {}

// The expected duration, s, of the rest of the study, by the predicted limits.
double expected(const Problem& problem, Simulation& system,
                const std::vector<MethodStability>& methods) {
  constexpr double kImplicitMeasured = 400;
  constexpr double kMeasured = 3000;           // steps until a limit is measured
  constexpr double kLook = 2, kFinerRun = 10;  // evaluations that a look at the energy is worth
  const double time = energy_time(system, methods), evaluation = seconds_an_evaluation(system);
  double seconds = 0;
  for (const MethodStability& each : methods) {
    if (has_own_steps(each.method)) continue;
    const double cost = cost_of_step(each.method);
    const double step = seconds_a_step(problem, each.method).value_or(cost * evaluation);
    seconds +=
        std::min(kPatience, (each.method.info.implicit ? kImplicitMeasured : kMeasured) * step);
    const std::optional<double> limit = step_limit(each);
    if (!bounded(limit)) continue;
    if (time > affordable_steps(system, each.method) * kFractions[0] * *limit) continue;
    for (const double fraction : kFractions)
      seconds += time / (fraction * *limit) * step *
                 (system.second_order() ? 1 + kLook / cost : 1 + kFinerRun);
  }
  return seconds;
}

}  // namespace

std::optional<double> step_limit(const MethodStability& method) {
  return method.measured ? method.measured : method.predicted;
}

Stability stability(const Problem& problem, const StabilityOptions& options, const Watch& watch) {
  const std::vector<Candidate> fitting = fitting_methods(problem, options.integrators);
  Simulation system = problem.simulation();
  Stability result;
  result.system = system.name();
  result.integrator = system.method().label();
  result.dt = system.h();
  for (const std::int64_t last = system.steps_for(options.at); system.step_count() < last;) {
    if (!system.step())
      throw Error(ErrorKind::kUsage,
                  {"no state to look at", "--at " + shortest(options.at),
                   "the run diverges in step " + std::to_string(system.step_count() + 1),
                   "choose a smaller --dt or an earlier time"});
    const double done = static_cast<double>(system.step_count()) / static_cast<double>(last);
    if (!watch("run to the state", done)) {
      result.complete = false;
      return result;
    }
  }
  result.t = system.t();
  result.spectrum = spectrum(system);
  std::vector<MethodStability> methods;
  for (const Candidate& method : fitting) {
    MethodStability& each = methods.emplace_back();
    each.method = method;
    each.predicted = predicted_step(*problem.with(method).make_integrator(), result.spectrum);
  }
  const double said = expected(problem, system, methods);
  if (options.announce) options.announce(said);
  const Stopwatch study;
  const auto study_late = [&] { return study.seconds() > kMostTimes * said + kLeastOverrun; };

  Standstill place(problem, system);
  const auto count = static_cast<double>(methods.size());
  for (MethodStability& method : methods) {
    const auto done = 0.5 * static_cast<double>(result.methods.size()) / count;
    if (!watch(method.method.label, done)) {
      result.complete = false;
      return result;
    }
    MethodStability& each = result.methods.emplace_back(std::move(method));
    if (has_own_steps(each.method)) continue;
    const Stopwatch watched;
    bool told = false;
    const auto late = [&] { return watched.seconds() > kPatience || study_late(); };
    place.system().stop_when([&] {
      told = told || !watch(each.method.label, done);
      return told || late();
    });
    measure_limit(place, result, each);
    const bool stopped = told || late();
    place.system().stop_when({});
    if (stopped) each.measured = each.radius = {};
    if (!told) continue;
    result.complete = false;
    return result;
  }

  result.energy_time = energy_time(system, result.methods);
  for (std::size_t i = 0; i < result.methods.size(); ++i) {
    MethodStability& each = result.methods[i];
    const std::optional<double> limit = step_limit(each);
    if (!bounded(limit) || has_own_steps(each.method)) continue;
    const double most = affordable_steps(system, each.method);
    if (result.energy_time > most * kFractions[0] * *limit) continue;
    bool told = false;
    for (const double fraction : kFractions) {
      const auto go_on = [&] {
        told = told ||
               !watch(each.method.label + ", energy", 0.5 + 0.5 * static_cast<double>(i) / count);
        return !told && !study_late();
      };
      const auto look = system.second_order() ? energy_at : error_at;
      const auto point =
          look(problem.with(each.method), fraction, fraction * *limit, result.energy_time, go_on);
      if (point) {
        each.energy.push_back(*point);
        continue;
      }
      result.complete = !told;
      if (told) return result;
      each.late = true;
      break;
    }
  }
  return result;
}

}  // namespace sim::study
