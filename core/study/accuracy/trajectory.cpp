#include "core/study/accuracy/trajectory.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/pacer.h"
#include "core/base/stopwatch.h"
#include "core/particles/particle_system.h"
#include "core/study/energy_balance.h"

namespace sim::study {
namespace {

constexpr std::int64_t kStepsBetweenLooks = 1024;
constexpr int kEnergies = 960;  // looks at the energy of an adaptive run, about

}  // namespace

std::vector<double> coordinates(Simulation& system) {
  std::vector<double> values;
  if (const ParticleSystem* particles = particles_of(system)) {
    const ParticleView view = particles->view(system.t(), system.state().data());
    for (int i = 0; i < view.n; ++i)
      if (view.free(i)) values.insert(values.end(), {view.x[i], view.y[i], view.z[i]});
  } else {
    values.assign(system.state().begin(), system.state().end());
  }
  return values;
}

std::vector<double> compared(const Problem& problem, Simulation& system) {
  return problem.of ? std::vector{problem.of->at(system)} : coordinates(system);
}

std::vector<double> free_coordinates(Simulation& system, const std::vector<double>& all) {
  const ParticleSystem* particles = particles_of(system);
  const std::size_t size = system.shape().first().count * system.shape().first().components.size();
  if (all.size() != size)
    throw Error(ErrorKind::kScene, {"exact solution of '" + system.name() + "'", "",
                                    "it has " + std::to_string(all.size()) +
                                        " numbers, the state " + std::to_string(size),
                                    ""});
  if (!particles) return all;
  const ParticleView view = particles->view(system.t(), system.state().data());
  std::vector<double> values;
  for (int i = 0; i < view.n; ++i)
    for (int axis = 0; axis < 3 && view.free(i); ++axis)
      values.push_back(all[static_cast<std::size_t>(3 * i + axis)]);
  return values;
}

Distance distance(const std::vector<double>& a, const std::vector<double>& b) {
  Distance result;
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double difference = std::abs(a[i] - b[i]);
    sum += difference * difference;
    if (difference <= result.most) continue;
    result.most = difference;
    result.where = static_cast<int>(i);
  }
  result.rms = a.empty() ? 0 : std::sqrt(sum / static_cast<double>(a.size()));
  return result;
}

double scene_size(const Simulation& system) {
  if (system.flat()) {
    double sum = 0;
    for (int i = 0; i < system.components(); ++i) sum += system.component(i) * system.component(i);
    return sum > 0 && std::isfinite(sum) ? std::sqrt(sum) : 1;
  }
  if (system.particles() == 0) return 1;
  Vec3 low = system.position(0), high = low;
  for (int i = 1; i < system.particles(); ++i) {
    low = low.cwiseMin(system.position(i));
    high = high.cwiseMax(system.position(i));
  }
  const double size = (high - low).stableNorm();
  if (size > 0) return size;
  const double distance = low.stableNorm();  // a single point: its distance from the origin
  return distance > 0 ? distance : 1;
}

Trajectory run_trajectory(const Problem& problem, const Candidate& method,
                          const TrajectoryPlan& plan, const std::function<bool()>& ask) {
  // Steps of three numbers take less time than an answer.
  Pacer pacer;
  const std::function<bool()> go_on = [&] { return !pacer.due() || ask(); };
  Problem with = problem.with(method);
  if (plan.tolerance > 0)
    with.options.integrator.given["tol"] = std::max(plan.tolerance, method.least_tolerance);
  Simulation system = with.simulation(plan.time / static_cast<double>(plan.steps));
  system.stop_when([&] { return !go_on(); });  // in long steps
  if (plan.begin) plan.begin(system);
  std::optional<EnergyBalance> balance;
  if (plan.energy && system.second_order()) balance.emplace(system);

  Trajectory result;
  result.time = plan.time;
  if (plan.see) plan.see(0, compared(problem, system));
  const std::int64_t stride = plan.steps / plan.intervals;
  bool good = !plan.shifted || system.step_to(0.5 * system.h());
  for (int k = 0; k < plan.intervals && good; ++k) {
    if (plan.shifted) {
      good = look_between_steps(system, plan.time * (k + 1) / plan.intervals, go_on, [&] {
        if (plan.see) plan.see(k + 1, compared(problem, system));
      });
      continue;
    }
    for (std::int64_t done = 0; done < stride && good;) {
      const std::int64_t next = std::min(stride, done + kStepsBetweenLooks);
      good = go_on();
      const Stopwatch watch;
      while (done < next && good) {
        const int taken = system.steps(balance ? 1 : next - done);
        done += taken;
        good = taken > 0;
        if (!good || !balance) continue;
        balance->advance();
        if (!method.info.adaptive || k % (1 + plan.intervals / kEnergies) == 0) balance->look();
      }
      result.seconds += watch.seconds();
    }
    if (good && plan.see) plan.see(k + 1, compared(problem, system));
  }
  result.finished = good;
  result.steps = system.step_count();
  result.effort = system.integrator().effort();
  result.effort.evaluations = evaluations_of(system);
  result.acted = contact_of(system);
  if (balance && !good) result.energy_error = HUGE_VAL;
  if (ConstraintSystem* constraint_system = system.constraint_system();
      constraint_system && plan.energy)
    result.drift = constraint_system->drift(system.t(), system.state().data());
  // The work of drag is not sampled between the states of an adaptive run.
  const bool seen = balance && !(method.info.adaptive && balance->has_drag());
  if (seen && good && balance->in_play() > 0 &&
      balance->uncertainty() <= 0.5 * std::abs(balance->error()))
    result.energy_error = std::abs(balance->error()) / balance->in_play();
  return result;
}

bool look_between_steps(Simulation& system, double t, const std::function<bool()>& go_on,
                        const std::function<void()>& see) {
  for (auto left = static_cast<std::int64_t>((t - system.t()) / system.h() + 1e-6); left > 0;) {
    const int taken = go_on() ? system.steps(std::min(left, kStepsBetweenLooks)) : 0;
    if (taken == 0) return false;
    left -= taken;
  }
  const Snapshot before = system.snapshot();
  if (t > system.t() && !system.step_to(t)) return false;
  see();
  system.restore(before);
  return true;
}

}  // namespace sim::study
