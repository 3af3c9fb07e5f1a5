#include "rigid_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "rotation.h"

namespace sim {
namespace {

constexpr std::size_t kNumbers = 7;  // of each point that is remembered
constexpr double kOverlap = 10;      // tolerances: the overlap left between bodies, of a radius
constexpr double kShare = 1e-2;      // of that: the accuracy of the moves that separate bodies, m
constexpr double kNear = 0.02;  // of a radius: the gap within which these moves may cause contact
constexpr double kAhead = 4;    // of the deepest overlap: the same
constexpr int kMostPasses = 20;
constexpr double kLoose = 1e-6;  // the tolerance with which closing contacts are found
constexpr double kAmiss = 1e-5;  // of a radius: the error of a gap from which moves are found anew
constexpr double kFit = 0.01;    // of that: the accuracy of these moves
constexpr double kFarthest = 2;  // of the way at the speeds at hand: moves of bodies by impulses
// Rounds in which contacts that close are stopped, with so many points and with fewer.
constexpr long kMany = 100;
constexpr long kFew = 32;  // points that touch: short flights are worth their cost
constexpr int kStopped = 1, kMostStopped = 8;
constexpr double kSlowContact = 0.05;  // of the largest speed of contact: what stops in any case
constexpr double kAtHand = 0.3;        // of the change of a speed: what it may add to an approach

}  // namespace

// A point bounces if forces do not bring it back soon or, among many points, within the step.
bool RigidContact::bounces(const ContactPoint& m) const {
  const double most = std::min(m.after, shortest_);
  return m.restitution > 0 && m.before * m.after < -2 * std::fabs(m.given) * most;
}

// At the end of the step, m and m/s, as impulses so far have it.
std::pair<double, double> RigidContact::gap_and_rate(const ContactPoint& m) const {
  return {m.gap + ContactSolver::moved(solver_bodies_, m),
          m.normal.dot(ContactSolver::velocity(solver_bodies_, m))};
}

// Activates the contacts that impulses close before the end of the step. True if there are any.
bool RigidContact::activate(double h, double& scale) {
  bool any = false;
  for (ContactPoint& m : contacts_) {
    if (m.active) continue;
    const auto [gap, rate] = gap_and_rate(m);
    if (gap >= -gap_tolerance_ * reach_[static_cast<std::size_t>(m.first)].scale || !(rate < 0))
      continue;
    m.active = any = true;
    m.duration = std::clamp(gap / rate, 0.0, h);
    scale = std::max(scale, -rate);
  }
  return any;
}

// The same where impulses run on through many bodies, as through chain mail, and would close a few
// more contacts each time: those around bodies that impulses have moved are activated as well, and
// held open, 0 <= gap at the end. The next step stops their approach. Slow approaches are stopped
// now, so that bodies that rest do not rattle.
bool RigidContact::hold_open(double h, double scale) {
  const double duration = 0.5 * h;
  const auto changed = [&](int i) {  // m/s, by impulses so far
    if (i < 0) return 0.0;
    const SolverBody& body = solver_bodies_[static_cast<std::size_t>(i)];
    const Reach& reach = reach_[static_cast<std::size_t>(i)];
    return (body.velocity - reach.after.velocity).norm() +
           reach.radius * (body.angular_velocity - reach.after.angular_velocity).norm();
  };
  bool any = false;
  for (ContactPoint& m : contacts_) {
    if (m.active) continue;
    const auto [gap, rate] = gap_and_rate(m);
    const bool closes = gap < 0 && rate < 0;
    const double offset = std::max(0.0, gap / duration - rate);
    if (!closes && offset > kAtHand * std::max(changed(m.first), changed(m.second))) continue;
    any = any || closes;
    m.active = true, m.duration = duration, m.offset = offset > kSlowContact * scale ? offset : 0;
  }
  return any;
}

// Solves impacts, and resting contacts, also those that impulses bring about.
double RigidContact::solve(const Step& step) {
  const double h = step.h;
  ContactSolver::prepare(contacts_, particles_->pool());
  const bool few = std::ranges::count_if(contacts_, &ContactPoint::active) <= kFew;
  shortest_ = few ? kShortestFlight * h : h;
  double scale = 0;
  bool any_bounces = false;
  for (const ContactPoint& m : contacts_) {
    if (!m.active) continue;
    any_bounces = any_bounces || bounces(m);
    scale = std::max(scale, std::fabs(m.before) + std::fabs(m.given) +
                                ContactSolver::velocity(solver_bodies_, m).norm());
  }
  if (any_bounces) {
    contact_solver_.solve_restitution(solver_bodies_, contacts_, h, shortest_, particles_->pool());
    // Bodies that bounced, or that others struck away, may approach again across a gap that the
    // step leaves open: their next impact belongs to a later step, and nothing rests there.
    for (ContactPoint& m : contacts_) {
      const auto [gap, rate] = gap_and_rate(m);
      if (gap > m.tiny && rate < 0) m.active = false;
      if (few && m.active && bounces(m) && rate < 0)
        m.duration = std::clamp(gap / rate, 0.0, m.after);
    }
  }
  if (few && !any_bounces)
    landing_solver_.solve(solver_bodies_, contacts_, h, tolerance_, resting_solver_,
                          particles_->pool());
  contact_solver_.start(solver_bodies_, contacts_);
  for (ContactPoint& m : contacts_) {
    if (!m.active) m.normal_impulse = m.tangent_impulse[0] = m.tangent_impulse[1] = 0;
    m.first_impulse = m.normal_impulse;
    m.first_rate = gap_and_rate(m).second;
  }
  // Contacts that close during the step are found with a loose tolerance first.
  double residual = 0, tolerance = std::max(kLoose, tolerance_);
  for (int round = 0; round < kMostPasses; ++round) {
    if (round + 1 == kMostPasses) tolerance = tolerance_;
    residual =
        resting_solver_.solve(solver_bodies_, contacts_, tolerance * scale, particles_->pool());
    if (particles_->pool().gives_up(0)) break;
    find_further(step);
    const bool many = std::ranges::count_if(contacts_, &ContactPoint::active) >= kMany;
    if (round < (many ? kStopped : kMostStopped) ? activate(h, scale) : hold_open(h, scale))
      continue;
    if (tolerance == tolerance_) break;
    tolerance = tolerance_;
  }
  for (ContactPoint& m : contacts_)
    if (m.offset > 0) m.active = m.normal_impulse > 0, m.offset = 0;
  counts_.fastest = std::max(counts_.fastest, scale);
  return residual;
}

// Impulses that press bodies against each other, and cancel, may be of any size; their moves would
// not cancel, as they act for different times. So a body that moves through others, and further
// than it would at the speeds of the free motion and of the end, moves as its change of velocity
// over half of the step does. True if any does.
bool RigidContact::bound_moves(double h) {
  bool any = false;
  for (int i = 0; i < body_collision_.bodies(); ++i) {
    SolverBody& body = solver_bodies_[static_cast<std::size_t>(i)];
    const Reach& reach = reach_[static_cast<std::size_t>(i)];
    const double moved = body.translation.norm() + reach.radius * body.rotation.norm(),
                 speed = body.velocity.norm() + reach.radius * body.angular_velocity.norm();
    if (!(moved > kFarthest * (reach.path_length + h * speed)) ||
        moved < body_collision_.thinness(i))
      continue;
    body.translation = 0.5 * h * (body.velocity - reach.after.velocity);
    body.rotation = 0.5 * h * (body.angular_velocity - reach.after.angular_velocity);
    any = true;
  }
  return any;
}

// Impulses act for different times where impacts meet resting contacts: the velocities fit together
// then, and the moves do not, so that some gaps open and others close. The moves along normals are
// found anew: 0 <= move, 0 <= gap, one of them 0.
void RigidContact::fit_moves(bool bounded) {
  const auto amiss = [&](const ContactPoint& m) {
    if (!m.active || bounces(m)) return false;
    const double gap = m.gap + ContactSolver::moved(solver_bodies_, m);
    const double off = m.normal_impulse > 0 ? std::fabs(gap) : -gap;
    return off > kAmiss * reach_[static_cast<std::size_t>(m.first)].scale;
  };
  if (!bounded && std::ranges::none_of(contacts_, amiss)) return;
  overlaps_.clear();
  double smallest = HUGE_VAL;
  for (const ContactPoint& m : contacts_) {
    if (!m.active || bounces(m)) continue;
    smallest = std::min(smallest, reach_[static_cast<std::size_t>(m.first)].scale);
    ContactPoint& move = overlaps_.emplace_back(m);
    move.offset = m.gap, move.ground = {}, move.friction = 0;
    move.normal_impulse = bounded ? 0 : m.duration * m.normal_impulse, move.friction_impulse = {};
  }
  copy_moves();
  solve_moves(overlaps_, std::min(kShare * kOverlap * tolerance_, kFit * kAmiss * smallest), false);
  take_moves();
}

// The moves of bodies, in the role of their velocities.
void RigidContact::copy_moves() {
  moved_bodies_ = solver_bodies_;
  for (SolverBody& each : moved_bodies_)
    each.velocity = each.translation, each.angular_velocity = each.rotation;
}

void RigidContact::take_moves() {
  for (std::size_t i = 0; i < solver_bodies_.size(); ++i)
    solver_bodies_[i].translation = moved_bodies_[i].velocity,
    solver_bodies_[i].rotation = moved_bodies_[i].angular_velocity;
}

void RigidContact::solve_moves(std::span<ContactPoint> contacts, double tolerance, bool further) {
  if (joints_) joints_->begin_moves(further);
  ContactSolver::prepare(contacts, particles_->pool());
  resting_solver_.solve(moved_bodies_, contacts, tolerance, particles_->pool());
  if (joints_) joints_->end_moves();
}

// True if no two bodies can overlap by more than they may, as far as their contact points tell. By
// small moves t, and rotations w, a gap changes linearly up to some |w| (|t| + |w| r); nothing else
// gets near that was beyond the margin within which points were sought.
bool RigidContact::stay_apart() const {
  return std::ranges::all_of(contacts_, [&](const ContactPoint& m) {
    double shift = 0, turn = 0, radius = 0, path = 0;
    for (const int side : {m.first, m.second}) {
      if (side < 0) continue;
      const auto at = static_cast<std::size_t>(side);
      shift += solver_bodies_[at].translation.norm();
      turn += solver_bodies_[at].rotation.norm();
      radius += reach_[at].radius;
      path += reach_[at].path_length;
    }
    const Reach& first = reach_[static_cast<std::size_t>(m.first)];
    const double most = shift + turn * radius;
    const double gap = m.gap + ContactSolver::moved(solver_bodies_, m);
    return !first.fast && most < path + kMargin * first.scale &&
           gap - 2 * turn * (most + path) > -kOverlap * tolerance_ * first.scale;
  });
}

// Moves overlapping bodies apart in the metric of the masses, repeatedly until none overlap.
void RigidContact::separate(double t) {
  if (stay_apart()) return;
  const auto now = [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    RigidState state = reach_[at].after;
    state.center += solver_bodies_[at].translation;
    state.axes = turned_over(state.axes, solver_bodies_[at].rotation);
    return state;
  };
  std::vector<ContactPoint>& contacts = overlaps_;
  std::vector<ManifoldPoint>& points = found_[0].points;
  const double overlap = kOverlap * tolerance_;
  double deepest = 0;
  for (int round = 0; round < kMostPasses; ++round) {
    contacts.clear();
    // Bodies that are moved may touch neighbours that they nearly touch.
    const double near = std::max(kNear, kAhead * deepest);
    deepest = 0;
    // Each pair once: its contact points are contiguous.
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      const ContactPoint& of = contacts_[k];
      if (k > 0 && contacts_[k - 1].first == of.first && contacts_[k - 1].second == of.second &&
          contacts_[k - 1].collider == of.collider)
        continue;
      points.clear();
      const double margin = near * reach_[static_cast<std::size_t>(of.first)].scale;
      const RigidState a = now(of.first);
      RigidState b;
      if (of.second >= 0) {
        b = now(of.second);
        body_collision_.find_contacts(of.first, a, of.second, b, margin, points);
      } else {
        body_collision_.find_contacts(of.first, a, static_cast<std::size_t>(of.collider), t, margin,
                                      points);
      }
      for (const ManifoldPoint& point : points) {
        ContactPoint m;
        m.first = of.first, m.second = of.second, m.collider = of.collider;
        m.normal = point.normal, m.arm1 = point.x - a.center, m.arm2 = point.x - b.center;
        m.offset = point.gap, m.active = true;
        contacts.push_back(m);
        deepest = std::max(deepest, -point.gap / reach_[static_cast<std::size_t>(of.first)].scale);
      }
    }
    if (deepest <= overlap || particles_->pool().gives_up(0)) return;
    moved_bodies_.resize(solver_bodies_.size());
    for (std::size_t i = 0; i < solver_bodies_.size(); ++i) {
      moved_bodies_[i] = solver_bodies_[i];
      moved_bodies_[i].velocity = moved_bodies_[i].angular_velocity = {};
    }
    solve_moves(contacts, kShare * kOverlap * tolerance_, true);
    for (std::size_t i = 0; i < solver_bodies_.size(); ++i) {
      solver_bodies_[i].translation += moved_bodies_[i].velocity;
      solver_bodies_[i].rotation += moved_bodies_[i].angular_velocity;
    }
  }
}

void RigidContact::store(double* x_next) {
  const auto q = particles_->layout().axes(x_next), v = particles_->layout().axes(x_next, 3);
  for (std::size_t i = 0; i < solver_bodies_.size(); ++i) {
    const SolverBody& solver_body = solver_bodies_[i];
    const RigidState& free = reach_[i].after;
    if (solver_body.inverse_mass == 0 ||
        (solver_body.velocity == free.velocity &&
         solver_body.angular_velocity == free.angular_velocity &&
         solver_body.translation == Vec3() && solver_body.rotation == Vec3()))
      continue;
    const auto bodies = static_cast<std::size_t>(body_collision_.bodies());
    if (i >= bodies) {
      const int id = entered_[i - bodies];
      for (std::size_t axis = 0; axis < 3; ++axis)
        q[axis][id] += solver_body.translation[axis], v[axis][id] = solver_body.velocity[axis];
      continue;
    }
    // A body that was rotated keeps its angular momentum, not its angular velocity.
    RigidState now = free;
    now.axes = turned_over(free.axes, solver_body.rotation);
    const RigidBody& body = body_collision_.body(static_cast<int>(i));
    const Vec3 angular_velocity =
        solver_body.rotation == Vec3()
            ? solver_body.angular_velocity
            : body.inverse_inertia(now) * (body.inertia(free) * solver_body.angular_velocity);
    for (int p = 0; p < RigidBody::kParticles; ++p) {
      const int id = body.first() + p;
      const Vec3 r =
          turned_over(Vec3(q[0][id], q[1][id], q[2][id]) - free.center, solver_body.rotation);
      const Vec3 place = free.center + solver_body.translation + r,
                 rate = solver_body.velocity + angular_velocity.cross(r);
      for (std::size_t axis = 0; axis < 3; ++axis)
        q[axis][id] = place[axis], v[axis][id] = rate[axis];
    }
  }
}

StepCorrection::Outcome RigidContact::resolve(const Step& step) {
  using Outcome = StepCorrection::Outcome;
  const auto [t, h, x, x_next, may_be_halved] = step;
  refusal_.clear();
  const auto too_long = [this, before = counts_] {
    counts_ = before;
    ++counts_.halved;
    return Outcome::kTooLong;
  };
  // Contact of single particles with colliders.
  const Layout& layout = particles_->layout();
  bool changed = false;
  if (contact_pass_) {
    contact_pass_->begin(t, t + h);
    particles_->pool().run_parts(body_collision_.singles(), 16, [&](int begin, int end) {
      contact_pass_->end(t, h, layout.axes(x), layout.axes(x, 3), layout.axes(x_next),
                         layout.axes(x_next, 3), begin, end);
    });
    const ContactWorkSums& work_sums = particles_->contacts().work_sums();
    if (!contact_pass_->succeeded())
      refusal_ = "particle " + std::to_string(work_sums.over_constrained()) +
                 " is squeezed between colliders and has no room left";
    changed = work_sums.any();
  }

  load(step);
  find(step);
  const bool touches = std::ranges::any_of(contacts_, &ContactPoint::active);
  if (!touches) {
    if (may_be_halved && pass_through(step)) return too_long();
    warm_start_.clear();
    if (!refusal_.empty()) return Outcome::kFailed;
    return changed ? Outcome::kChanged : Outcome::kUnchanged;
  }
  if (joints_) {
    joints_->begin(body_collision_, solver_bodies_, entered_, t + h, x_next);
  }
  const double unconverged = solve(step);
  if (particles_->pool().gives_up(0)) return Outcome::kChanged;
  const bool bounded = bound_moves(h);
  fit_moves(bounded);
  separate(t + h);
  if (particles_->pool().gives_up(0)) return Outcome::kChanged;
  if (may_be_halved && pass_through(step)) return too_long();
  counts_.unconverged = std::max(counts_.unconverged, unconverged);
  const auto energy = [&] {
    return particles_->kinetic_energy(t + h, x_next) + particles_->potential_energy(t + h, x_next);
  };
  const double before = energy();
  store(x_next);
  if (joints_ && !joints_->store(x_next)) refusal_ = joints_->refusal();
  work_ += before - energy();
  store_warm_start();
  return refusal_.empty() ? Outcome::kChanged : Outcome::kFailed;
}

// Stores the impulses of this step for the next.
void RigidContact::store_warm_start() {
  warm_start_.clear();
  int most = 0;
  for (const ContactPoint& m : contacts_) {
    if (!m.active) continue;
    ++most;
    // Past velocities are stopped once: their share in the change of the impulse is not kept.
    const double share = m.first_rate != 0 ? std::clamp(m.before / m.first_rate, 0.0, 1.0) : 0;
    const double normal = m.normal_impulse - share * (m.normal_impulse - m.first_impulse);
    const Vec3 pull = m.tangent_impulse[0] * m.u + m.tangent_impulse[1] * m.v;
    if (normal > 0)
      warm_start_.push_back(
          {m.key1, m.key2, m.feature, pull - share * (pull - m.friction_impulse), normal});
  }
  counts_.most = std::max(counts_.most, most);
  // Particles became solver bodies in the order in which they were found.
  if (!entered_.empty())
    std::ranges::sort(warm_start_, {},
                      [](const WarmStart& k) { return std::tuple(k.first, k.second, k.feature); });
}

std::vector<double> RigidContact::memory() const {
  std::vector<double> numbers;
  for (const WarmStart& k : warm_start_)
    numbers.insert(numbers.end(), {static_cast<double>(k.first), static_cast<double>(k.second),
                                   static_cast<double>(k.feature), k.friction_impulse[0],
                                   k.friction_impulse[1], k.friction_impulse[2], k.normal_impulse});
  return numbers;
}

void RigidContact::recall(std::span<const double> memory) {
  warm_start_.clear();
  const auto whole = [](double x) {  // whatever a file says
    return std::fabs(x) < std::numeric_limits<int>::max() ? static_cast<int>(x) : 0;
  };
  const auto feature = [](double x) {
    return std::fabs(x) < 1e15 ? static_cast<std::int64_t>(x) : std::int64_t{0};
  };
  for (std::size_t k = 0; k + kNumbers <= memory.size(); k += kNumbers)
    warm_start_.push_back({whole(memory[k]),
                           whole(memory[k + 1]),
                           feature(memory[k + 2]),
                           {memory[k + 3], memory[k + 4], memory[k + 5]},
                           memory[k + 6]});
}

double RigidContact::take_work() { return std::exchange(work_, 0.0); }

}  // namespace sim
