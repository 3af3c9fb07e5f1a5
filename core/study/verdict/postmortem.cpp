#include "core/study/verdict/postmortem.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/base/error.h"
#include "core/math/elementary.h"
#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"
#include "core/study/limits/spectrum.h"
#include "core/study/limits/step_limit.h"
#include "core/study/verdict/sampling_schedule.h"
#include "core/study/verdict/step_doubling.h"

namespace sim::study {
namespace {

constexpr double kGone = 1;         // strain at which a spring is out of its range
constexpr double kMostWork = 5e7;   // particle-steps of all runs that are tried
constexpr double kMostTries = 2e5;  // of an adaptive run, whose steps are its own

// Ends a watched task after so many seconds in all.
class Limited {
 public:
  Limited(const Watch& watch, double seconds)
      : watch_(watch), begin_(Clock::now()), seconds_(seconds) {}

  // Watches until that share of the time is used up.
  Watch until(double share) const {
    return [this, share](std::string_view what, double done) {
      const std::chrono::duration<double> used = Clock::now() - begin_;
      return used.count() <= share * seconds_ && watch_(what, done);
    };
  }

 private:
  using Clock = std::chrono::steady_clock;
  const Watch& watch_;
  Clock::time_point begin_;
  double seconds_;
};

// The size of each share of the force on one particle.
std::vector<std::pair<std::string, double>> largest_forces(const Simulation& system, int i) {
  std::vector<std::pair<std::string, double>> forces;
  for (const ForceShare& share : system.forces_on(i))
    forces.emplace_back(share.name, share.force.stableNorm());
  std::stable_sort(forces.begin(), forces.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return forces;
}

// The end of a spring that the force moves more.
int mobile_end(Simulation& system, const StrainedSpring& spring) {
  const ParticleView view = particles_of(system)->view(system.t(), system.state().data());
  if (view.mass[spring.a] != view.mass[spring.b])
    return view.mass[spring.a] < view.mass[spring.b] ? spring.a : spring.b;
  return system.velocity(spring.a).norm() >= system.velocity(spring.b).norm() ? spring.a : spring.b;
}

// Repeats the run watching the worst spring. It fails when its strain passes 100 %, and ten times
// its initial strain. Long steps end on request too.
void find_first_spring(Simulation& system, std::int64_t steps, const Watch& watch,
                       PostMortem& result) {
  const auto go_on = [&] {
    return watch("what went first",
                 0.3 * static_cast<double>(system.step_count()) / static_cast<double>(steps));
  };
  system.stop_when([&] { return !go_on(); });
  const double at_start = std::abs(worst_spring(system).strain);
  const double gone = std::max(kGone, 10 * at_start);
  double first = 0, last = 0;
  while (system.step_count() < steps) {
    if (!go_on()) {
      result.complete = false;
      break;
    }
    if (!system.step()) {
      result.complete = system.divergence().status != StepStatus::kStopped;
      break;
    }
    const StrainedSpring worst = worst_spring(system);
    if (worst.a < 0) continue;
    const double strain = std::abs(worst.strain);
    if (!std::isfinite(strain)) break;
    if (!result.spring && strain > gone) {
      result.spring = worst;
      result.family = family_of(system, worst.a, worst.b);
      result.since = system.step_count();
      result.t = system.t();
      result.particle = mobile_end(system, worst);
      result.forces = largest_forces(system, result.particle);
      first = strain;
    }
    if (result.spring) last = strain;
  }
  system.stop_when({});
  result.step = system.step_count();
  if (result.spring && result.step > result.since)
    result.growth =
        elementary::pow(last / first, 1 / static_cast<double>(result.step - result.since));
}

double size_of(const Problem& problem) {
  return problem.spec->particles ? std::max(1, problem.spec->particles->count()) : 1;
}

bool affordable(const Problem& problem, double time, double dt, double& work) {
  work += time / dt * size_of(problem);
  return work <= kMostWork;
}

// Tries steps from 80 % of the limit downwards, halving.
void try_smaller(const Problem& problem, double limit, double time, const Watch& watch,
                 PostMortem& result) {
  constexpr int kAttempts = 8;
  double dt = result.dt / 2, work = 0;
  if (limit > 0 && limit < HUGE_VAL) dt = std::min(dt, 0.8 * limit);
  const double digit = elementary::pow(10, std::floor(elementary::log10(dt)) - 1);
  dt = std::floor(dt / digit) * digit;
  for (int attempt = 0; attempt < kAttempts; ++attempt, dt /= 2) {
    if (!affordable(problem, time, dt, work)) {
      result.complete = false;
      return;
    }
    auto run = try_run(problem, dt, time, watch);
    if (!run) {
      result.complete = false;
      return;
    }
    if (!PostMortem::works(run->verdict)) continue;
    result.smaller = std::move(run);
    return;
  }
}

// Opens the methods one by one, for each takes its time in a large scene.
std::vector<Candidate> methods_that_fit(const Problem& problem, const Watch& watch) {
  std::vector<Candidate> methods;
  for (const std::string& name : problem.registry->names<Integrator>()) {
    if (!watch("remedies", 0.3)) break;
    try {
      methods.push_back(fitting_methods(problem, {{name}}).front());
    } catch (const Error&) {  // it does not fit, or needs values
    }
  }
  return methods;
}

// Tries methods that are stable at this step by their own account, the cheapest first.
void try_others(const Problem& problem, const Spectrum& modes, double time, const Watch& watch,
                PostMortem& result) {
  std::vector<Candidate> methods = methods_that_fit(problem, watch);
  std::erase_if(methods, [&](const Candidate& method) {
    if (method.name == result.integrator) return true;
    if (method.info.adaptive) return false;
    const auto limit = predicted_step(*problem.with(method).make_integrator(), modes);
    return !limit || *limit < 1.25 * result.dt;
  });
  const auto cost = [](const Candidate& method) {
    return method.info.implicit ? 1000 : method.info.adaptive ? 100 : method.info.evaluations;
  };
  std::stable_sort(methods.begin(), methods.end(),
                   [&](const Candidate& a, const Candidate& b) { return cost(a) < cost(b); });
  double work = 0;
  for (const Candidate& method : methods) {
    // An adaptive method chooses its steps, several in each radian of the fastest mode.
    const double omega = modes.fastest.omega;
    const bool own = method.info.adaptive && omega > 0;
    if (!affordable(problem, time, own ? std::min(result.dt, 0.2 / omega) : result.dt, work)) {
      result.complete = false;
      return;
    }
    auto run = try_run(problem.with(method), result.dt, time, watch);
    if (!run) {
      result.complete = false;
      return;
    }
    if (!PostMortem::works(run->verdict)) continue;
    run->integrator = method.label;
    result.other = std::move(run);
    return;
  }
}

}  // namespace

std::optional<Remedy> try_run(const Problem& problem, double dt, double time, const Watch& watch) {
  Simulation system = problem.simulation(dt);
  Remedy result{"", dt, system.steps_for(time), {}};
  bool told = false;
  const std::function<bool()> stop = [&] {
    const double part =
        static_cast<double>(system.step_count()) / static_cast<double>(result.steps + 1);
    told = told || !watch("remedies", 0.3 + 0.7 * part);
    return told;
  };
  // An adaptive method may approach a singularity in ever smaller steps.
  const double most_a_step = std::max(1e4, kMostTries / size_of(problem));
  double tries = 0, most = 0;
  system.stop_when([&] { return ++tries > most || stop(); });
  Monitor monitor(*problem.spec, system, result.steps, problem.registry);
  StepDoubling shadow(*problem.spec, system, result.steps, *problem.registry);
  SamplingSchedule looks(0, result.steps);
  const auto look = [&] {
    const Energy energy = system.energy();
    const Energy* const known = system.second_order() ? &energy : nullptr;
    monitor.look(known);
    shadow.look(known);
  };
  if (looks.take(0)) look();
  while (system.step_count() < result.steps) {
    if (stop()) return {};
    const std::int64_t due = std::min(
        {looks.next() - system.step_count(), monitor.due(), result.steps - system.step_count()});
    const std::int64_t asked = std::max<std::int64_t>(1, due);
    tries = 0;
    most = most_a_step * static_cast<double>(asked);
    const int taken = system.steps(asked);
    if (taken == 0) {
      if (told) return {};
      result.verdict = {Trust::kDiverged, "it diverges, too", {}};
      return result;
    }
    monitor.advance(taken);
    if (looks.take(system.step_count())) look();
  }
  system.stop_when(stop);
  result.verdict = monitor.verdict();
  if (result.verdict.trust == Trust::kDiverged) return result;
  result.verdict = monitor.verdict(shadow.compare(stop));
  if (told) return {};
  return result;
}

PostMortem post_mortem(const Problem& problem, std::int64_t steps, double time, double seconds,
                       const Watch& watch) {
  constexpr double kFirst = 0.4, kSmaller = 0.7;  // shares of the time, with those before
  const Limited limited(watch, seconds);
  PostMortem result;
  Simulation system = problem.simulation();
  result.integrator = system.method().name();
  result.choice = system.method().label();
  result.dt = system.h();
  const Spectrum modes = spectrum(system);
  const auto limit = predicted_step(system.integrator(), modes);
  result.limit_share = !limit ? std::nan("") : *limit == 0 ? HUGE_VAL : result.dt / *limit;
  find_first_spring(system, steps, limited.until(kFirst), result);
  if (!(time > 0)) return result;
  try_smaller(problem, limit.value_or(0), time, limited.until(kSmaller), result);
  try_others(problem, modes, time, limited.until(1), result);
  return result;
}

}  // namespace sim::study
