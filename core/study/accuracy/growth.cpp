#include "core/study/accuracy/growth.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "core/base/array.h"
#include "core/base/hash.h"
#include "core/particles/particle_system.h"

namespace sim::study {
namespace {

constexpr int kRuns = 8;
constexpr double kDisturbance = 1e-8;

// Normally distributed, the same in every program: by the method of Box and Muller (1958).
double normal(std::uint64_t run, std::uint64_t index) {
  const auto uniform = [&](std::uint64_t which) {
    StateHash hash;
    for (const std::uint64_t word : {run, index, which}) hash.add(word);
    return (static_cast<double>(hash.value() >> 11) + 0.5) / 9007199254740992.0;
  };
  return std::sqrt(-2 * std::log(uniform(0))) * std::cos(2 * std::numbers::pi * uniform(1));
}

// The places in X of the coordinates that are free to move.
std::vector<std::size_t> free_places(Simulation& system) {
  std::vector<std::size_t> places;
  const ParticleSystem* particles = particles_of(system);
  if (!particles) {
    for (std::size_t i = 0; i < system.state().size(); ++i) places.push_back(i);
    return places;
  }
  const ParticleView view = particles->view(system.t(), system.state().data());
  const StatePart& position = *system.shape().find("position");
  for (std::size_t i = 0; i < position.count; ++i)
    for (std::size_t axis = 0; axis < 3 && view.free(static_cast<int>(i)); ++axis)
      places.push_back(position.at(i, axis));
  return places;
}

// The states at the output times, each only in the places; nothing when it fails or is told to end.
std::optional<std::vector<std::vector<double>>> states(Simulation& system, Integrator& integrator,
                                                       const Array& start,
                                                       const std::vector<std::size_t>& places,
                                                       double time, int intervals,
                                                       std::int64_t steps, const Watch& watch,
                                                       double done) {
  Array x(start.size()), x_next(start.size());
  std::ranges::copy(start.span(), x.data());

  const double h = time / static_cast<double>(steps);
  integrator.restart(0, h, x.data());
  std::vector<std::vector<double>> points;
  for (std::int64_t step = 0;; ++step) {
    if (step % (steps / intervals) == 0) {
      std::vector<double>& point = points.emplace_back();
      for (const std::size_t i : places) point.push_back(x[i]);
    }
    if (step == steps) return points;
    if (step % 1024 == 0 && !watch("growth of a disturbance", done)) return {};
    if (integrator.step(system.ode(), static_cast<double>(step) * h, h, x.data(), x_next.data()) !=
        StepStatus::kDone)
      return {};
    std::swap(x, x_next);
  }
}

double rms(const std::vector<double>& a, const std::vector<double>& b) {
  return distance(a, b).rms;
}

}  // namespace

void disturb(Simulation& system, double size, std::uint64_t run, std::span<double> x) {
  std::ranges::copy(system.state(), x.begin());
  const std::vector<std::size_t> places = free_places(system);
  for (std::size_t i = 0; i < places.size(); ++i) x[places[i]] += size * normal(run, i);
}

Growth growth(const Problem& problem, const Reference& reference, double time, const Watch& watch) {
  Growth result;
  result.complete = false;
  if (reference.steps == 0) return result;
  const int intervals = kIntervals;
  Simulation system = problem.simulation();
  const std::unique_ptr<Integrator> integrator = problem.with(reference.method).make_integrator();
  integrator->prepare(system.ode());
  const std::vector<std::size_t> places = free_places(system);
  Array start(system.state().size());
  std::ranges::copy(system.state(), start.data());
  const double size = kDisturbance * scene_size(system);

  const auto run = [&](double done) {
    return states(system, *integrator, start, places, time, intervals, reference.steps, watch,
                  done);
  };
  const auto undisturbed = run(0.2);
  if (!undisturbed || places.empty()) return result;
  result.mean.assign(undisturbed->size(), 0.0);
  result.most = result.mean;
  for (int each = 0; each < kRuns; ++each) {
    disturb(system, size, static_cast<std::uint64_t>(each), start.span());
    const auto disturbed = run(0.2 + 0.02 * each);
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
