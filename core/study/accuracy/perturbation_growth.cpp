#include "core/study/accuracy/perturbation_growth.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "core/base/hash.h"
#include "core/math/elementary.h"
#include "core/particles/particle_system.h"

namespace sim::study {
namespace {

constexpr int kRuns = 8;
constexpr double kDisturbance = 1e-8;

// Normally distributed numbers, the same in every program (Box and Muller 1958).
double normal(std::uint64_t run, std::uint64_t index) {
  const auto uniform = [&](std::uint64_t which) {
    StateHash hash;
    for (const std::uint64_t word : {run, index, which}) hash.add(word);
    return (static_cast<double>(hash.value() >> 11) + 0.5) / 9007199254740992.0;
  };
  return std::sqrt(-2 * elementary::log(uniform(0))) *
         elementary::cos(2 * std::numbers::pi * uniform(1));
}

// The indices in X of the coordinates that are free to move.
std::vector<std::size_t> free_places(Simulation& system) {
  std::vector<std::size_t> positions;
  const ParticleSystem* particles = particles_of(system);
  if (!particles) {
    for (std::size_t i = 0; i < system.state().size(); ++i) positions.push_back(i);
    return positions;
  }
  const ParticleView view = particles->view(system.t(), system.state().data());
  const StatePart& position = *system.shape().find("position");
  for (std::size_t i = 0; i < position.count; ++i)
    for (std::size_t axis = 0; axis < 3 && view.free(static_cast<int>(i)); ++axis)
      positions.push_back(position.at(i, axis));
  return positions;
}

double rms(const std::vector<double>& a, const std::vector<double>& b) {
  return distance(a, b).rms;
}

}  // namespace

void disturb(Simulation& system, double size, std::uint64_t run, std::span<double> x) {
  std::ranges::copy(system.state(), x.begin());
  const std::vector<std::size_t> positions = free_places(system);
  for (std::size_t i = 0; i < positions.size(); ++i) x[positions[i]] += size * normal(run, i);
}

PerturbationGrowth growth(const Problem& problem, const Reference& reference, double time,
                          const Watch& watch) {
  PerturbationGrowth result;
  result.complete = false;
  if (reference.steps == 0) return result;
  Simulation system = problem.simulation();
  const double size = kDisturbance * scene_size(system);
  using Points = std::vector<std::vector<double>>;
  const auto run = [&](double done, std::optional<std::uint64_t> disturbed) {
    Points points;
    TrajectoryPlan plan{.time = time, .intervals = kIntervals, .steps = reference.steps};
    plan.see = [&](int, const std::vector<double>& x) { points.push_back(x); };
    if (disturbed)
      plan.begin = [&](Simulation& at_start) {
        Snapshot start = at_start.snapshot();
        disturb(at_start, size, *disturbed, start.x);
        start.memory.clear();
        at_start.restore(start);
      };
    const auto go_on = [&] { return watch("growth of a disturbance", done); };
    const bool finished = run_trajectory(problem, reference.method, plan, go_on).finished;
    return finished ? std::optional(points) : std::nullopt;
  };
  const auto undisturbed = run(0.2, {});
  if (!undisturbed || undisturbed->front().empty()) return result;
  result.mean.assign(undisturbed->size(), 0.0);
  result.most = result.mean;
  for (int each = 0; each < kRuns; ++each) {
    const auto disturbed = run(0.2 + 0.02 * each, static_cast<std::uint64_t>(each));
    if (!disturbed) return result;
    const double at_start = rms(disturbed->front(), undisturbed->front());
    for (std::size_t k = 0; k < undisturbed->size(); ++k) {
      const double grown = rms((*disturbed)[k], (*undisturbed)[k]) / at_start;
      result.mean[k] += grown / kRuns;
      result.most[k] = std::max(result.most[k], grown);
    }
  }
  result.complete = true;
  return result;
}

}  // namespace sim::study
