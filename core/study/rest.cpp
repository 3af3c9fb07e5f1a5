#include "core/study/rest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/base/noise.h"
#include "core/base/stopwatch.h"
#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/limits/spectrum.h"
#include "core/study/limits/step_limit.h"

namespace sim::study {
namespace {

constexpr double kNearly = 1e-6;  // of the forces in play: what may be left of them

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
  each_number(simulation.shape(), "velocity",
              [&](std::size_t i) { most = larger_error(std::fabs(slope[i]), most); });
  return most;
}

// N, the largest sum of forces on a free particle; and the largest of one kind into in_play.
double measure_forces(const Simulation& simulation, double& in_play) {
  const auto forces = simulation.forces_on(0, simulation.particles());
  double most = 0;
  for (int i = 0; i < simulation.particles(); ++i) {
    if (simulation.pinned(i)) continue;
    Vec3 sum = Vec3::Zero();
    for (const ForceShare& share : forces[static_cast<std::size_t>(i)]) {
      in_play = std::max(in_play, share.force.norm());
      sum += share.force;
    }
    most = std::max(most, sum.norm());
  }
  return most;
}

// N, the largest difference of the force on a free particle from x to other places or times.
double largest_change(Simulation& simulation, double t, const double* x, double other_t,
                      const double* other_x) {
  OdeSystem& system = simulation.ode();
  const std::span<const double> masses = dynamic_cast<const Particles&>(system).masses();
  Array at(system.size()), slope(system.size()), other(system.size());
  system.eval(t, {x, {}}, at.data(), slope.data());
  system.eval(other_t, {other_x, {}}, at.data(), other.data());
  const StatePart& velocity = *simulation.shape().find("velocity");
  double most = 0;
  for (std::size_t i = 0; i < velocity.count; ++i) {
    if (!std::isfinite(masses[i])) continue;
    for (std::size_t axis = 0; axis < velocity.components.size(); ++axis) {
      const std::size_t k = velocity.at(i, axis);
      most = std::max(most, masses[i] * std::fabs(other[k] - slope[k]));
    }
  }
  return most;
}

// N, what roundings of all coordinates change of the forces: those that are no larger are none.
double rounding_of_forces(Simulation& simulation) {
  constexpr double kRoundings = 16;  // which the elements at a particle add up
  const std::span<const double> now = simulation.state();
  std::vector<double> moved(now.begin(), now.end());
  double most = scene_size(simulation);
  const StatePart& place = simulation.shape().first();
  const auto each = [&](const auto& visit) {
    for (std::size_t i = 0; i < place.count; ++i)
      for (std::size_t axis = 0; axis < place.components.size(); ++axis)
        visit(moved[place.at(i, axis)]);
  };
  each([&](double& number) { most = std::max(most, std::fabs(number)); });
  const double move = std::numeric_limits<double>::epsilon() * most;
  Noise noise;
  each([&](double& number) { number += noise.next() > 0 ? move : -move; });
  const double t = simulation.t();
  return kRoundings * largest_change(simulation, t, now.data(), t, moved.data());
}

// True if forces on the present state are others at other times of the scene.
bool depends_on_time(Simulation& simulation, double in_play) {
  constexpr int kTimes = 16;
  constexpr double kUnknown = 1;  // s, of a scene without a duration
  if (!dynamic_cast<const ParticleSystem&>(simulation.ode()).prescribed().empty()) return true;
  const double duration = simulation.duration() > 0 ? simulation.duration() : kUnknown;
  const double allowed = std::max(kNearly * in_play, rounding_of_forces(simulation));
  const double t = simulation.t();
  const double* const x = simulation.state().data();
  Noise noise;
  for (int i = 0; i < kTimes; ++i) {
    const double later = t + duration * (i + noise.next() + 0.5) / kTimes;
    if (largest_change(simulation, t, x, later, x) > allowed) return true;
  }
  return false;
}

constexpr double kUnbound = 1000;  // sizes of the scene: nothing that is held goes so far
constexpr double kAfar = 1e30;     // m

Vec3 displacement(const StatePart& positions, std::size_t i, const double* x, const double* start) {
  Vec3 moved = Vec3::Zero();
  for (std::size_t axis = 0; axis < positions.components.size(); ++axis)
    moved[static_cast<int>(axis)] = x[positions.at(i, axis)] - start[positions.at(i, axis)];
  return moved;
}

// A motion that nothing holds, of all free particles that went half as far as any; empty if none
// went further than `far`, m.
std::string free_motion(const Simulation& simulation, const double* x, const double* start,
                        double far) {
  const StatePart& positions = simulation.shape().first();
  const auto way_of = [&](std::size_t i) {
    if (simulation.pinned(static_cast<int>(i))) return 0.0;
    const double way = displacement(positions, i, x, start).norm();
    return std::isnan(way) ? 0.0 : way;
  };
  double most = 0;
  for (std::size_t i = 0; i < positions.count; ++i) most = std::max(most, way_of(i));
  if (most <= far) return "";
  std::size_t first = 0;
  int count = 0;
  Vec3 way = Vec3::Zero();
  for (std::size_t i = positions.count; i-- > 0;) {
    const Vec3 moved = displacement(positions, i, x, start);
    if (!(way_of(i) >= 0.5 * most)) continue;
    first = i;
    ++count;
    for (int axis = 0; axis < 3; ++axis)  // may be infinite
      way[axis] += std::clamp(moved[axis], -kAfar, kAfar) / kAfar;
  }
  const double length = way.norm();
  std::string text = "particle " + std::to_string(first) + " moves away without end";
  for (int axis = 0; axis < 3 && length > 0; ++axis) {
    const double share = way[axis] / length;
    text += (axis == 0 ? ", along (" : ", ") + brief(std::fabs(share) < 5e-3 ? 0 : share, 2);
  }
  if (length > 0) text += ")";
  return text + (count > 1 ? ", and " + std::to_string(count - 1) + " more with it" : "");
}

// Throws for scenes that have no rest, or whose rest is not looked for.
void check(const Simulation& simulation) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw Error(ErrorKind::kUsage, {"no rest to be found", simulation.name(), why, remedy});
  };
  if (!simulation.second_order())
    refuse("a first-order scene has no forces that could balance", "run it for long instead");
  const Contacts& contacts = dynamic_cast<const Particles&>(simulation.ode()).contacts();
  if (std::ranges::any_of(contacts.all(), [](const Collider* each) { return each->moves(); }))
    refuse("a collider moves, and what touches it moves with it",
           "give it no motion, or leave it out with --without");
}

bool rests_on_contact(const Simulation& simulation) {
  const Contacts& contacts = dynamic_cast<const Particles&>(simulation.ode()).contacts();
  return !contacts.empty() || !simulation.corrections().empty();
}

int broken(const Simulation& simulation) {
  return static_cast<int>(simulation.settings().broken.size());
}

// True if a state at rest loads ties beyond what they bear, so that they break in a step from it.
bool overloads(Simulation& simulation) {
  if (!simulation.breaks()) return false;
  const Snapshot rest = simulation.snapshot();
  const int before = broken(simulation);
  simulation.step();
  const bool more = broken(simulation) > before;
  simulation.restore(rest);
  return more;
}

// The largest m |v| / h or 2 m |dx| / h^2 after a step of the length h from rest, N: what falls on
// something within it may have no velocity at its end. Moves of up to `slack`, m, are none. nan
// where no step can be taken.
double force_after_step(Simulation& simulation, const Snapshot& rest, double slack) {
  if (!simulation.step()) return std::nan("");
  const std::span<const double> masses = dynamic_cast<const Particles&>(simulation.ode()).masses();
  const StatePart& place = simulation.shape().first();
  const double h = simulation.h();
  double most = 0;
  for (int i = 0; i < simulation.particles(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!std::isfinite(masses[k])) continue;
    double square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t at = place.at(k, axis);
      const double moved = simulation.state()[at] - rest.x[at];
      square += moved * moved;
    }
    const double speed =
        std::max(simulation.velocity(i).norm(), 2 * (std::sqrt(square) - slack) / h);
    most = std::max(most, masses[k] * speed / h);
  }
  return most;
}

// Explains why no rest was found; `refused` steps did not converge at the end of the search. away:
// a motion that nothing holds.
void explain(Rest& rest, const std::string& away, int refused, bool idle) {
  rest.remedy = "run the scene with drag until it rests";
  if (!away.empty()) {
    rest.why = away;
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

// Steps of a search by kinetic damping, s. Rest has no error of time, so that the step may be 0.9
// of the limit, and four times that of the scene, where nothing but particles on colliders moves.
// The bound on frequencies also holds for a scene that has folded. Both steps are that of the scene
// where no limit is known.
struct SearchSteps {
  double first = 0, careful = 0;
};

SearchSteps search_steps(Simulation& simulation, bool rough) {
  const double h = simulation.h();
  if (rough || simulation.integrator_info().adaptive) return {h, h};
  const auto within_limit = [&](const Vibration& mode) {
    const double share = step_share(simulation.integrator(), mode, h).share;
    return share > 0 && share < HUGE_VAL ? std::min(0.9 / share, 4.0) * h : h;
  };
  const double damping = smallest_damping(simulation);
  Vibration fastest = limiting_vibration(simulation, 40);
  fastest.damping = std::max(fastest.damping, 0.0);
  const double first = within_limit(fastest);
  return {first, std::min(first, within_limit({omega_bound(simulation), damping}))};
}

// With kinetic damping, see the header.
Rest by_kinetic_damping(Simulation& simulation, const std::function<bool()>& stop) {
  constexpr std::int64_t kMostSteps = 30'000, kMore = 500;  // after forces are good
  constexpr double kWait = 30;                              // s; who waits longer runs the scene
  constexpr int kIdle = 100;                                // peaks without a clearly smaller force
  constexpr double kFound = 1e-6, kBetter = 0.9;
  constexpr double kSettles = 1e-6;  // of the size, by which rods and bodies are led back
  // The share of the forces in play that friction of constrained particles, and contact of bodies
  // and surfaces, may leave.
  const bool rough = simulation.constraint_system() || !simulation.corrections().empty();
  const double good = rough ? 1e-3 : kFound;
  const Stopwatch watch;
  const auto& particles = dynamic_cast<const Particles&>(simulation.ode());
  const Snapshot begin = simulation.snapshot();
  const double size = scene_size(simulation), rounding = rounding_of_forces(simulation);
  const SearchSteps h = search_steps(simulation, rough);
  const auto halt = [&](Snapshot& state) {
    each_number(simulation.shape(), "velocity", [&](std::size_t i) { state.x[i] = 0; });
    state.memory.clear();
    simulation.restore(state);
  };
  const auto go_on_from = [&](const Snapshot& from, double step) {
    Snapshot state = from;
    halt(state);
    simulation.set_dt(step);
    return simulation.snapshot();
  };
  Rest rest;
  rest.t = simulation.t();
  rest.force = HUGE_VAL;
  Snapshot state = go_on_from(begin, h.first), best = state;
  double kinetic = -1;
  double mark = HUGE_VAL;  // N, the last force that was clearly smaller
  int idle = 0;            // peaks since then
  std::string away;        // a motion that nothing holds
  std::int64_t good_since = -1;
  simulation.stop_when(stop);
  for (std::int64_t& steps = rest.effort.steps; steps < kMostSteps && away.empty(); ++steps) {
    if (stop && stop()) {
      rest.why = "interrupted";
      break;
    }
    if (watch.seconds() > kWait) {
      rest.why = brief(kWait, 3) + " s were not enough";
      rest.remedy = "run the scene with drag until it rests";
      break;
    }
    const bool fresh = kinetic < 0;
    const double force = fresh ? force_after_step(simulation, state, rough ? kSettles * size : 0)
                         : simulation.step() ? 0
                                             : std::nan("");
    const bool fails = std::isnan(force) && !(stop && stop());
    if ((fails || idle == kIdle) && simulation.h() > h.careful) {
      state = go_on_from(best, h.careful);
      kinetic = -1;
      idle = 0;
      continue;
    }
    if (std::isnan(force)) {
      rest.why = fails ? "a step towards it fails" : "interrupted";
      break;
    }
    if (fresh && simulation.settings().broken != state.settings->broken) {
      state = simulation.snapshot();  // what was at rest did not bear it
      halt(state);
      continue;
    }
    if (good_since >= 0 && steps - good_since > kMore) break;
    if (fresh && ++idle > kIdle) break;
    if (fresh && force < kBetter * mark) mark = force, idle = 0;
    if (fresh && force < rest.force) {
      rest.force = force;
      best = state;
      rest.in_play = 0;
      measure_forces(simulation, rest.in_play);
      if (good_since < 0 && force <= good * rest.in_play) good_since = steps;
      if (force <= std::max(kFound * rest.in_play, rounding)) {
        rest.found = true;
        break;
      }
    }
    const double now = particles.kinetic_energy(simulation.t(), simulation.state().data());
    if (now > kinetic) {
      kinetic = now;
      if (steps % 1000 == 0)
        away = free_motion(simulation, simulation.state().data(), begin.x.data(), kUnbound * size);
      continue;
    }
    state = simulation.snapshot();
    halt(state);
    kinetic = -1;
  }
  simulation.stop_when({});
  best.step = begin.step, best.n0 = begin.n0, best.t0 = begin.t0;
  auto settings = std::make_shared<Settings>(*best.settings);
  settings->h = begin.settings->h;
  best.settings = std::move(settings);
  halt(best);
  rest.potential = simulation.energy().potential;
  rest.broke = broken(simulation) - static_cast<int>(begin.settings->broken.size());
  rest.found =
      rest.found || (rest.why.empty() && away.empty() && rest.force <= good * rest.in_play);
  rest.at_this_time = depends_on_time(simulation, rest.in_play);
  if (!rest.found && rest.why.empty()) explain(rest, away, 0, idle > kIdle);
  return rest;
}

}  // namespace

Rest come_to_rest(Simulation& simulation, const std::function<bool()>& stop) {
  constexpr int kNewtonSteps = 200, kIdle = 4;
  constexpr double kShrink = 0.25, kEnough = 1e-14;
  check(simulation);
  if (rests_on_contact(simulation)) return by_kinetic_damping(simulation, stop);
  OdeSystem& system = simulation.ode();
  const std::size_t size = system.size();
  const auto solver = system.stage_solver({.tolerance = 1e-12, .long_steps = true});
  const Snapshot begin = simulation.snapshot();
  Snapshot snapshot = begin;
  Array x(size), next(size), best(size), at(size), slope(size);
  std::ranges::copy(snapshot.x, x.data());
  const std::vector<double>& start = begin.x;
  const double size_at_start = scene_size(simulation);
  const auto halt = [&](Array& state) {
    each_number(simulation.shape(), "velocity", [&](std::size_t i) { state[i] = 0; });
  };
  halt(x);
  std::ranges::copy(x.span(), best.data());

  Rest rest;
  rest.t = simulation.t();
  std::ranges::copy(x.span(), snapshot.x.begin());
  simulation.restore(snapshot);
  const double rounding = rounding_of_forces(simulation);
  const bool rests = measure_forces(simulation, rest.in_play) <= rounding;
  double least = largest_acceleration(simulation, x.data(), at, slope), scale = least;
  double h = 10 * simulation.h();
  int idle = 0, refused = 0;
  system.stop_when(stop);
  int left = rests ? 0 : kNewtonSteps;
  for (; left > 0 && least > kEnough * scale && idle < kIdle; --left) {
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
  rest.in_play = 0;
  rest.force = measure_forces(simulation, rest.in_play);
  rest.found = rest.why.empty() && rest.force <= std::max(kNearly * rest.in_play, rounding);
  rest.at_this_time = depends_on_time(simulation, rest.in_play);
  if (rest.found && overloads(simulation)) {
    simulation.restore(begin);
    return by_kinetic_damping(simulation, stop);
  }
  if (!rest.found && rest.why.empty())
    explain(rest, free_motion(simulation, x.data(), start.data(), kUnbound * size_at_start),
            refused, idle == kIdle);
  return rest;
}

}  // namespace sim::study
