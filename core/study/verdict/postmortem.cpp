#include "core/study/verdict/postmortem.h"

#include <algorithm>
#include <cmath>

#include "core/particles/springs/springs.h"
#include "core/study/limits/spectrum.h"
#include "core/study/limits/step_limit.h"

namespace sim::study {
namespace {

constexpr double kGone = 1;         // strain at which a spring is out of its range
constexpr double kMostWork = 5e7;   // particle-steps of all runs that are tried
constexpr double kMostTries = 2e5;  // of an adaptive run, whose steps are its own
constexpr int kLooks = 100;         // of the monitor in a run

// How large each share of the force on one particle is.
std::vector<std::pair<std::string, double>> largest_forces(const Simulation& system, int i) {
  std::vector<std::pair<std::string, double>> forces;
  for (const ForceShare& share : system.forces_on(i))
    forces.emplace_back(share.name, share.force.stableNorm());
  std::stable_sort(forces.begin(), forces.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return forces;
}

// The end of a spring that the force moves most.
int mobile_end(Simulation& system, const StrainedSpring& spring) {
  const ParticleView view = particles_of(system)->view(system.t(), system.state().data());
  if (view.mass[spring.a] != view.mass[spring.b])
    return view.mass[spring.a] < view.mass[spring.b] ? spring.a : spring.b;
  return system.velocity(spring.a).norm() >= system.velocity(spring.b).norm() ? spring.a : spring.b;
}

// Runs again with an eye on the worst spring. It has gone when its strain passes 100 %, and ten
// times what it was at the start.
void find_first_spring(Simulation& system, std::int64_t steps, const Watch& watch,
                       PostMortem& result) {
  const double at_start = std::abs(worst_spring(system).strain);
  const double gone = std::max(kGone, 10 * at_start);
  double first = 0, last = 0;
  while (system.step_count() < steps) {
    const std::int64_t step = system.step_count();
    if (step % 256 == 0 &&
        !watch("what went first", 0.3 * static_cast<double>(step) / static_cast<double>(steps))) {
      result.complete = false;
      break;
    }
    if (!system.step()) break;
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
  result.step = system.step_count();
  if (result.spring && result.step > result.since)
    result.growth = std::pow(last / first, 1 / static_cast<double>(result.step - result.since));
}

double size_of(const Problem& problem) {
  return problem.spec->particles ? std::max(1, problem.spec->particles->count()) : 1;
}

bool affordable(const Problem& problem, double time, double dt, double& work) {
  work += time / dt * size_of(problem);
  return work <= kMostWork;
}

// From 80 % of the limit downwards by halves.
void try_smaller(const Problem& problem, double limit, double time, const Watch& watch,
                 PostMortem& result) {
  constexpr int kAttempts = 8;
  double dt = result.dt / 2, work = 0;
  if (limit > 0 && limit < HUGE_VAL) dt = std::min(dt, 0.8 * limit);
  const double digit = std::pow(10, std::floor(std::log10(dt)) - 1);
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
    if (run->verdict.trust != Trust::kTrusted) continue;
    result.smaller = std::move(run);
    return;
  }
}

// Methods that stand this step by their own account, the cheapest first.
void try_others(const Problem& problem, const Spectrum& modes, double time, const Watch& watch,
                PostMortem& result) {
  std::vector<Candidate> methods = fitting_methods(problem, {});
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
    // An adaptive method takes steps of its own, some in each radian of the fastest mode.
    const double omega = modes.fastest.omega;
    const bool own = method.info.adaptive && omega > 0;
    if (!affordable(problem, time, own ? std::min(result.dt, 0.2 / omega) : result.dt, work))
      return;
    auto run = try_run(problem.with(method), result.dt, time, watch);
    if (!run) {
      result.complete = false;
      return;
    }
    if (run->verdict.trust != Trust::kTrusted) continue;
    run->integrator = method.label;
    result.other = std::move(run);
    return;
  }
}

}  // namespace

std::optional<Remedy> try_run(const Problem& problem, double dt, double time, const Watch& watch) {
  Simulation system = problem.simulation(dt);
  // An adaptive method may creep up to a singularity in ever smaller steps.
  double tries = 0;
  system.stop_when(
      [&tries, most = std::max(1e4, kMostTries / size_of(problem))] { return ++tries > most; });
  Remedy result{"", dt, system.steps_for(time), {}};
  Monitor monitor(*problem.spec, system, result.steps, problem.registry);
  const std::int64_t stride = std::max<std::int64_t>(1, result.steps / kLooks);
  for (std::int64_t step = 0; step <= result.steps; ++step) {
    if (step % 256 == 0 && !watch("remedies", 0.3 + 0.7 * static_cast<double>(step) /
                                                        static_cast<double>(result.steps)))
      return {};
    if (step > 0) {
      if (!system.step()) {
        result.verdict = {Trust::kDiverged, "it diverges, too", {}};
        return result;
      }
      monitor.advance();
    }
    if (step % stride != 0 && step != result.steps) continue;
    const Energy energy = system.energy();
    monitor.look(system.second_order() ? &energy : nullptr);
  }
  result.verdict = monitor.verdict();
  return result;
}

PostMortem post_mortem(const Problem& problem, std::int64_t steps, double time,
                       const Watch& watch) {
  PostMortem result;
  Simulation system = problem.simulation();
  result.integrator = system.method().name();
  result.choice = system.method().label();
  result.dt = system.h();
  const Spectrum modes = spectrum(system);
  const auto limit = predicted_step(system.integrator(), modes);
  result.limit_share = !limit ? std::nan("") : *limit == 0 ? HUGE_VAL : result.dt / *limit;
  find_first_spring(system, steps, watch, result);
  if (!result.complete || !(time > 0)) return result;
  try_smaller(problem, limit.value_or(0), time, watch, result);
  try_others(problem, modes, time, watch, result);
  return result;
}

}  // namespace sim::study
