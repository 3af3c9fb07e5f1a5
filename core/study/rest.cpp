#include "core/study/rest.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/study/accuracy/trajectory.h"

namespace sim::study {
namespace {

// Visits the numbers of a part of X by item and component.
template <class Visit>
void each_number(const StateShape& shape, const std::string& name, const Visit& visit) {
  for (const StatePart& part : shape.parts())
    if (part.name == name)
      for (std::size_t component = 0; component < part.components.size(); ++component)
        for (std::size_t i = 0; i < part.count; ++i) visit(part.at(i, component));
}

double largest_acceleration(Simulation& simulation, const double* x, Array& at, Array& slope) {
  simulation.ode().eval(simulation.t(), {x, {}}, at.data(), slope.data());
  double most = 0;
  each_number(simulation.shape(), "velocity", [&](std::size_t i) {
    const double size = std::fabs(slope[i]);
    if (!(size <= most)) most = size;
  });
  return most;
}

void measure_forces(const Simulation& simulation, Rest& rest) {
  const auto forces = simulation.forces_on(0, simulation.particles());
  for (int i = 0; i < simulation.particles(); ++i) {
    if (simulation.pinned(i)) continue;
    Vec3 sum = Vec3::Zero();
    for (const ForceShare& share : forces[static_cast<std::size_t>(i)]) {
      rest.in_play = std::max(rest.in_play, share.force.norm());
      sum += share.force;
    }
    rest.force = std::max(rest.force, sum.norm());
  }
}

// The largest displacement of a coordinate.
double largest_move(const StateShape& shape, const double* x, const double* start) {
  double most = 0;
  const StatePart& positions = shape.first();
  for (std::size_t component = 0; component < positions.components.size(); ++component)
    for (std::size_t i = 0; i < positions.count; ++i)
      most = std::max(most,
                      std::fabs(x[positions.at(i, component)] - start[positions.at(i, component)]));
  return most;
}

// Explains why no rest was found; `refused` steps did not converge at the end of the search.
void explain(Rest& rest, bool moves_away, int refused, bool idle) {
  rest.remedy = "run the scene with drag until it rests";
  if (moves_away) {
    rest.why = "a part of the scene moves away without end";
    rest.remedy = "pin a particle, or give it something to lie on";
  } else if (refused > 0) {
    rest.why = "the last " + std::to_string(refused) + " steps did not converge";
  } else if (idle) {
    rest.why = "forces no longer become smaller";
  } else {
    rest.why = std::to_string(rest.effort.steps) + " steps were not enough";
  }
}

// The factor by which the next step may grow after one with so many Newton iterations: few show
// that forces hardly change in it.
double growth(std::int64_t iterations) { return iterations <= 3 ? 16 : iterations <= 8 ? 4 : 2; }

}  // namespace

Rest come_to_rest(Simulation& simulation, const std::function<bool()>& stop) {
  constexpr int kSteps = 200, kIdle = 4;
  constexpr double kShrink = 0.25, kEnough = 1e-14, kNearly = 1e-6;
  constexpr double kFar = 1000;  // sizes of the scene, beyond which nothing bound moves
  if (!simulation.second_order())
    throw Error(ErrorKind::kUsage, {"no rest to be found", simulation.name(),
                                    "a first-order scene has no forces that could balance",
                                    "run it for long instead"});
  OdeSystem& system = simulation.ode();
  const std::size_t size = system.size();
  const auto solver = system.stage_solver({.tolerance = 1e-12, .long_steps = true});
  Snapshot snapshot = simulation.snapshot();
  Array x(size), next(size), best(size), at(size), slope(size);
  std::ranges::copy(snapshot.x, x.data());
  const std::vector<double> start = snapshot.x;
  const double size_at_start = scene_size(simulation);
  const auto halt = [&](Array& state) {
    each_number(simulation.shape(), "velocity", [&](std::size_t i) { state[i] = 0; });
  };
  halt(x);
  std::ranges::copy(x.span(), best.data());

  Rest rest;
  double least = largest_acceleration(simulation, x.data(), at, slope), scale = least;
  double h = 10 * simulation.h();
  int idle = 0, refused = 0;
  system.stop_when(stop);
  for (int step = 0; step < kSteps && least > kEnough * scale && idle < kIdle; ++step) {
    if (stop && stop()) {
      rest.why = "interrupted";
      break;
    }
    std::ranges::copy(x.span(), next.data());
    const std::int64_t before = solver->effort().newton;
    const StepStatus status = solver->solve(simulation.t(), h, x.data(), next.data());
    if (status == StepStatus::kStopped) continue;
    if (status != StepStatus::kDone) {
      h *= kShrink;
      ++idle;
      ++refused;
      continue;
    }
    refused = 0;
    halt(next);
    std::swap(x, next);
    const double now = largest_acceleration(simulation, x.data(), at, slope);
    scale = std::max(scale, now);
    idle = now < 0.9 * least || least > kNearly * scale ? 0 : idle + 1;
    if (now < least) {
      least = now;
      std::ranges::copy(x.span(), best.data());
    }
    h *= growth(solver->effort().newton - before);
    ++rest.effort.steps;
  }
  system.stop_when({});
  std::copy(best.data(), best.data() + size, snapshot.x.begin());
  snapshot.memory.clear();
  simulation.restore(snapshot);
  const std::int64_t steps = rest.effort.steps;
  rest.effort = solver->effort();
  rest.effort.steps = steps;
  rest.potential = simulation.energy().potential;
  measure_forces(simulation, rest);
  rest.found = rest.why.empty() && rest.force <= kNearly * rest.in_play;
  if (!rest.found && rest.why.empty())
    explain(rest,
            !(largest_move(simulation.shape(), x.data(), start.data()) <= kFar * size_at_start),
            refused, idle == kIdle);
  return rest;
}

}  // namespace sim::study
