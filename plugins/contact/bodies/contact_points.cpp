// The broad phase of rigid bodies: the pairs that may touch in a step, and their contact points.
#include "rigid_contact.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <tuple>

namespace sim {
namespace {

constexpr double kBodyGapTolerance = 1e-8;  // of a radius: a gap that is none
constexpr double kNeighbours = 2;  // times its radius, around a body that was not pushed yet
constexpr double kOnwards = 2;     // times as far as impulses lead bodies, contact is sought again
constexpr std::size_t kManyPairs = 256;  // that threads share
constexpr int kManyBodies = 256;
constexpr double kPressed = 1e-5;  // of a radius: the gap of what pressed in the step before
constexpr int kMostLooks = 64;     // places at which a fast body is looked at inside a step

// The search margin of a solver body, m, which includes the motion that impulses may add.
double margin_of(double path_length, double radius) {
  return 2 * path_length + RigidContact::kMargin * radius;
}

// Estimates path length and effective duration from the states at both ends.
template <class Reach>
void measure(Reach& reach, double h) {
  const RigidState &a = reach.before, &b = reach.after;
  reach.path_length =
      h * (std::max(a.velocity.norm(), b.velocity.norm()) +
           reach.radius * std::max(a.angular_velocity.norm(), b.angular_velocity.norm()));
  // The duration is half a step for most methods, a whole one for symplectic Euler.
  const Vec3 gained = b.velocity - a.velocity, moved = b.center - a.center - h * a.velocity;
  reach.gained = gained.squaredNorm();
  reach.duration =
      reach.gained > 0 ? std::clamp(moved.dot(gained) / reach.gained, 0.25 * h, h) : 0.5 * h;
}

// The state at a fraction `left` of the step h before its end.
template <class Reach>
RigidState on_the_way(const Reach& reach, double left, double h) {
  RigidState state = reach.after;
  if (!(left > 0)) return state;
  state.center -= left * (reach.after.center - reach.before.center);
  const Vec3 turn = 0.5 * left * h * (reach.before.angular_velocity + reach.after.angular_velocity);
  if (turn != Vec3()) state.axes = turned_by(-turn) * state.axes;
  return state;
}

// The same with the moves that impulses cause, as if they grew linearly.
template <class Reach>
RigidState on_the_way(const Reach& reach, const SolverBody& moved, double left, double h) {
  RigidState state = on_the_way(reach, left, h);
  state.center += (1 - left) * moved.translation;
  if (moved.rotation != Vec3()) state.axes = turned_by((1 - left) * moved.rotation) * state.axes;
  return state;
}

// The path length, m, of points of one body as seen from the other.
template <class Reach>
double relative_path(const Reach& one, const Reach& other, double h) {
  const auto speed = [](const RigidState& a, const RigidState& b) {
    return (a.velocity - b.velocity).norm();
  };
  const auto turning = [](const Reach& reach) {
    return reach.radius *
           std::max(reach.before.angular_velocity.norm(), reach.after.angular_velocity.norm());
  };
  return h * (std::max(speed(one.before, other.before), speed(one.after, other.after)) +
              turning(one) + turning(other));
}

// True if a point that moves from one place to another comes so near to the origin.
bool comes_within(double distance, const Vec3& from, const Vec3& to) {
  const Vec3 way = to - from;
  const double square = way.squaredNorm();
  const double share = square > 0 ? std::clamp(-from.dot(way) / square, 0.0, 1.0) : 0;
  return (from + share * way).squaredNorm() <= distance * distance;
}

}  // namespace

RigidContact::RigidContact(BodyCollision body_collision, Particles& particles,
                           ConstraintSystem* constraint_system, double tolerance)
    : body_collision_(std::move(body_collision)),
      particles_(&particles),
      tolerance_(tolerance),
      gap_tolerance_(std::max(kBodyGapTolerance, tolerance)),
      solver_body_of_(static_cast<std::size_t>(body_collision_.singles()), -1) {
  if (constraint_system) {
    joints_ = std::make_unique<BodyJoints>(particles, *constraint_system);
    contact_solver_.set_joints(joints_.get());
    resting_solver_.set_joints(joints_.get());
  }
  if (!particles.contacts().empty() && !constraint_system) contact_pass_.emplace(particles);
  constexpr int kFew = 4096;  // more make room when they come
  const auto most = static_cast<std::size_t>(body_collision_.bodies() +
                                             std::min(kFew, body_collision_.singles()));
  entered_.reserve(most);
  reach_.reserve(most);
  solver_bodies_.reserve(most);
  moved_bodies_.reserve(most);
  balls_.resize(static_cast<std::size_t>(body_collision_.bodies()));
  for (int i = 0; i < body_collision_.bodies(); ++i)
    if (body_collision_.touches(i)) broad_phase_.take(i);
  for (int p = 0; p < body_collision_.singles(); ++p)
    if (!body_collision_.leaves_out(p)) loose_.push_back(p);
}

int RigidContact::key(int solver_body) const {
  const int bodies = body_collision_.bodies();
  if (solver_body < bodies) return solver_body;
  return bodies + entered_[static_cast<std::size_t>(solver_body - bodies)];
}

void RigidContact::load(const Step& step) {
  const ParticleView from = particles_->view(step.t, step.x),
                     to = particles_->view(step.t + step.h, step.x_next);
  for (const int particle : entered_) solver_body_of_[static_cast<std::size_t>(particle)] = -1;
  entered_.clear();
  const auto bodies = static_cast<std::size_t>(body_collision_.bodies());
  reach_.resize(bodies);
  solver_bodies_.resize(bodies);
  const auto load_one = [&](std::size_t i) {
    Reach& reach = reach_[i];
    const RigidBody& body = body_collision_.body(static_cast<int>(i));
    reach.before = body.state(from);
    reach.after = body.state(to);
    reach.radius = reach.scale = body_collision_.radius(static_cast<int>(i));
    measure(reach, step.h);
    reach.fixed = reach.fast = false;
    for (int p = 0; p < RigidBody::kParticles; ++p)
      reach.fixed = reach.fixed || !to.free(body.first() + p);
    SolverBody& solver_body = solver_bodies_[i] = {};
    solver_body.center = reach.after.center, solver_body.gained = std::sqrt(reach.gained);
    solver_body.velocity = reach.after.velocity;
    solver_body.angular_velocity = reach.after.angular_velocity;
    if (reach.fixed) return;
    solver_body.inverse_mass = 1 / body.mass();
    solver_body.inverse_inertia = body.inverse_inertia(reach.after);
  };
  particles_->pool().run_if_many(body_collision_.bodies(), kManyBodies, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) load_one(static_cast<std::size_t>(i));
  });
  // Others may take over the path of a body that bounces.
  double longest = 0;
  for (std::size_t i = 0; i < bodies; ++i)
    if (body_collision_.surface(static_cast<int>(i)).restitution > 0)
      longest = std::max(longest, reach_[i].path_length);
  for (Reach& reach : reach_) reach.pushed = longest;
  fastest_single_ = 0;
  for (const int p : loose_)
    fastest_single_ = std::max(
        fastest_single_, std::max(from.velocity(p).squaredNorm(), to.velocity(p).squaredNorm()));
  fastest_single_ = std::sqrt(fastest_single_);
}

// Adds a particle near a body as a solver body without size and rotation. Its contact force acts as
// long in the step as that of the body: otherwise the particle could not rest between the body and
// a collider.
int RigidContact::enter(int particle, int body, const Step& step) {
  int& solver_body = solver_body_of_[static_cast<std::size_t>(particle)];
  if (solver_body >= 0) return solver_body;
  solver_body = static_cast<int>(solver_bodies_.size());
  entered_.push_back(particle);
  const ParticleView from = particles_->view(step.t, step.x),
                     to = particles_->view(step.t + step.h, step.x_next);
  Reach& reach = reach_.emplace_back();
  reach.before.center = from.position(particle), reach.before.velocity = from.velocity(particle);
  reach.after.center = to.position(particle), reach.after.velocity = to.velocity(particle);
  reach.fixed = !to.free(particle);
  measure(reach, step.h);
  const Reach& near = reach_[static_cast<std::size_t>(body)];
  reach.scale = near.radius, reach.pushed = near.pushed;
  reach.duration = near.duration, reach.gained = near.gained;
  SolverBody& added = solver_bodies_.emplace_back();
  added.center = reach.after.center, added.velocity = reach.after.velocity;
  added.gained = std::sqrt(reach.gained);
  if (!reach.fixed) added.inverse_mass = 1 / to.mass[particle];
  return solver_body;
}

void RigidContact::add_contact(const ManifoldPoint& point, int first, int second, int collider,
                               const Step& step, double left, Found& found) const {
  const double t = step.t, h = step.h;
  const auto f = static_cast<std::size_t>(first);
  ContactPoint& m = found.contacts.emplace_back();
  m.key1 = key(first), m.key2 = second >= 0 ? key(second) : -1 - collider;
  m.first = first, m.second = second, m.collider = collider, m.feature = point.feature;
  m.normal = point.normal, m.rounding = point.rounding;
  const auto center = [&](std::size_t i) {
    return reach_[i].after.center - left * (reach_[i].after.center - reach_[i].before.center);
  };
  const auto at = [&](const RigidState& state, const Vec3& arm) {
    return state.velocity + state.angular_velocity.cross(arm);
  };
  m.arm1 = point.x + (second < 0 ? 0.5 * point.gap : 0.0) * point.normal - center(f);
  Vec3 now = at(reach_[f].after, m.arm1), before = at(reach_[f].before, m.arm1);
  ContactMaterial other;
  double size = reach_[f].scale;
  if (second >= 0) {
    const auto s = static_cast<std::size_t>(second);
    m.arm2 = point.x - center(s);
    now -= at(reach_[s].after, m.arm2);
    before -= at(reach_[s].before, m.arm2);
    other = body_collision_.surface(second < body_collision_.bodies() ? second : first);
    size = std::min(size, reach_[s].scale);
  } else {
    Collider& solid = *particles_->contacts().all()[static_cast<std::size_t>(collider)];
    m.ground = solid.query(t + h, point.x).velocity;
    now -= m.ground;
    before -= solid.moves() ? solid.query(t, point.x).velocity : m.ground;
    other = solid.material();
  }
  const ContactMaterial& own =
      first < body_collision_.bodies() ? body_collision_.surface(first) : other;
  if (own.law || other.law) m.sides[0] = own, m.sides[1] = other;
  m.friction = std::sqrt(own.friction * other.friction);
  if (m.has_law()) m.friction = m.friction_at(tangential(before, m.normal).norm());
  m.restitution = std::max(own.restitution, other.restitution);

  // The motion of the gap in the step, from its end and the rates at both ends.
  const double rate = m.normal.dot(now), rate0 = m.normal.dot(before), a = (rate - rate0) / h;
  const Vec3 slip_gain = tangential(now - before, m.normal);
  // The duration of the side that is not fixed.
  constexpr double kHeld = 1e-6;
  const Reach* kinematic = &reach_[f];
  if (second >= 0)
    if (const Reach& with = reach_[static_cast<std::size_t>(second)];
        reach_[f].gained <= kHeld * with.gained)
      kinematic = &with;
  const double duration = kinematic->duration, change = h * rate0 + duration * (rate - rate0);
  m.gap = point.gap + left * change;
  const double tiny = m.tiny = gap_tolerance_ * size, gap0 = m.gap - change;
  apply_warm_start(m, found.kept);
  // Joints may lift a body off what held it up, if only because nothing holds up the others yet.
  const bool pressed = joints_ && m.normal_impulse > 0 && gap0 <= kPressed * size;
  if (gap0 <= tiny || pressed) {
    m.before = rate0, m.given = rate - rate0, m.after = h, m.duration = duration;
    m.path_gap = gap0 + h * rate0, m.path_gain = m.given, m.path_slip_gain = slip_gain;
    m.active = m.gap <= tiny || pressed;
  } else {
    m.path_gap = m.gap, m.acceleration = a, m.slip_acceleration = slip_gain / h;
    m.active = m.gap < 0;
    m.after = m.active ? time_since(m.gap, rate, a, h) : 0;
    m.given = a * m.after;
    m.before = rate - m.given;
    m.duration = rate < 0 ? std::clamp(m.gap / rate, 0.0, h) : duration;
  }
}

// Applies the impulses of the step before. kept: where those of a pair begin, perhaps of this one.
void RigidContact::apply_warm_start(ContactPoint& m, std::size_t& kept) const {
  const auto key = [](const WarmStart& kept) { return std::pair(kept.first, kept.second); };
  const std::pair own(m.key1, m.key2);
  const auto begin = warm_start_.begin();
  auto place = begin + static_cast<std::ptrdiff_t>(kept);
  if (kept >= warm_start_.size() || key(*place) != own)
    place = std::ranges::lower_bound(warm_start_, own, {}, key);
  kept = static_cast<std::size_t>(place - begin);
  for (; place != warm_start_.end() && key(*place) == own; ++place)
    if (place->feature == m.feature) {
      m.normal_impulse = place->normal_impulse;
      const Vec3& n = m.normal;
      const Vec3 pull = place->friction_impulse - n.dot(place->friction_impulse) * n;
      m.friction_impulse = within_cone(pull, m.friction * m.normal_impulse);
      return;
    }
}

// Takes the arms of the points of one pair at the time at which they act, from a common point each,
// so that angular momentum is conserved. The time is the same for all, the mean of the active ones:
// otherwise the arms of two points would belong to no rigid body, and no impulses could make both
// stick.
void RigidContact::move_arms(std::span<ContactPoint> of_pair) const {
  const bool touches = std::ranges::any_of(of_pair, &ContactPoint::active);
  double sum = 0, count = 0;
  for (const ContactPoint& m : of_pair)
    if (m.active || !touches) sum += m.duration, ++count;
  const double duration = sum / count;
  const auto at = [](const RigidState& state, const Vec3& arm) {
    return state.velocity + state.angular_velocity.cross(arm);
  };
  for (ContactPoint& m : of_pair) {
    const RigidState &one = reach_[static_cast<std::size_t>(m.first)].after,
                     &two = reach_[static_cast<std::size_t>(m.second)].after;
    const Vec3 drift = 0.5 * (at(one, m.arm1) + at(two, m.arm2));
    m.arm1 += duration * (one.velocity - drift);
    m.arm2 += duration * (two.velocity - drift);
  }
}

// Adds the contact points of one pair at the end of the free step; for a pair so fast that it may
// have passed through by then, at the first of some sampled times with contact.
template <class Collide>
void RigidContact::add_manifold(int first, int second, int collider, double margin,
                                const Step& step, Found& found, const Collide& collide) {
  const Reach& own = reach_[static_cast<std::size_t>(first)];
  double path_length = own.path_length, thin = body_collision_.thinness(first);
  if (second >= 0) {
    path_length = relative_path(own, reach_[static_cast<std::size_t>(second)], step.h);
    if (second < body_collision_.bodies()) thin = std::min(thin, body_collision_.thinness(second));
  }
  const int trials = static_cast<int>(std::clamp(2 * path_length / thin, 1.0, double{kMostLooks}));
  for (int k = 1; k <= trials; ++k) {
    const double left = static_cast<double>(trials - k) / trials;
    found.points.clear();
    collide(left, k == trials ? margin : 0.0);
    if (found.points.empty()) continue;
    const std::size_t begin = found.contacts.size();
    reach_[static_cast<std::size_t>(first)].fast |= left > 0;
    for (const ManifoldPoint& point : found.points)
      add_contact(point, first, second, collider, step, left, found);
    if (second >= 0) move_arms(std::span(found.contacts).subspan(begin));
    return;
  }
}

// The balls, around bodies at the end of the free step, within which they meet others.
void RigidContact::find_pairs() {
  for (std::size_t i = 0; i < balls_.size(); ++i) {
    const Reach& reach = reach_[i];
    balls_[i].center = reach.after.center;
    balls_[i].radius = reach.radius + margin_of(reach.path_length, reach.radius) + reach.pushed;
  }
  broad_phase_.update(balls_, [&](int i, int j) { return body_collision_.are_joined(i, j); });
}

// Finds the single particles that may touch bodies, among the balls of the sweep.
void RigidContact::find_particle_pairs(const Step& step) {
  particle_pairs_.clear();
  if (loose_.empty()) return;
  const ParticleView to = particles_->view(step.t + step.h, step.x_next);
  const double path = 2 * step.h * fastest_single_;
  for (const int p : loose_) {
    const Vec3 x = to.position(p);
    broad_phase_.each_near(x, path, [&](int body) {
      const Reach& own = reach_[static_cast<std::size_t>(body)];
      const double most = balls_[static_cast<std::size_t>(body)].radius + path + own.pushed;
      if ((x - own.after.center).squaredNorm() > most * most) return;
      if (body_collision_.are_tied(body, p) || (own.fixed && !to.free(p))) return;
      particle_pairs_.emplace_back(body, p);
    });
  }
  std::ranges::sort(particle_pairs_);
}

void RigidContact::touch_particle(int body, int particle, const Step& step, Found& found) {
  const int second = enter(particle, body, step);
  const auto reach_of = [&](int i) -> const Reach& { return reach_[static_cast<std::size_t>(i)]; };
  const double path_length = reach_of(body).path_length + reach_of(second).path_length;
  const double margin = margin_of(path_length, reach_of(body).radius) + reach_of(body).pushed +
                        reach_of(second).pushed;
  add_manifold(body, second, -1, margin, step, found, [&](double left, double margin_now) {
    body_collision_.find_contacts(body, on_the_way(reach_of(body), left, step.h), second,
                                  on_the_way(reach_of(second), left, step.h), margin_now,
                                  found.points);
  });
}

// Seeks contact further on, where impulses lead a body beyond the margin within which it was
// sought, and around all others, which may be pushed on, but not beyond their neighbours. Points
// that are known keep what is known of them.
void RigidContact::find_further(const Step& step) {
  const auto led = [&](std::size_t i) {
    const SolverBody& body = solver_bodies_[i];
    const Reach& reach = reach_[i];
    const double moved = body.translation.norm() + reach.radius * body.rotation.norm(),
                 speed = body.velocity.norm() + reach.radius * body.angular_velocity.norm();
    return std::min(moved, reach.path_length + step.h * speed) -
           margin_of(reach.path_length, reach.scale);
  };
  double most = 0;
  bool enough = true;
  for (std::size_t i = 0; i < reach_.size(); ++i) {
    most = std::max(most, led(i));
    enough = enough && led(i) <= reach_[i].pushed;
  }
  if (enough) return;
  for (std::size_t i = 0; i < reach_.size(); ++i)
    reach_[i].pushed = std::max({reach_[i].pushed, kOnwards * led(i),
                                 std::min(kOnwards * most, kNeighbours * reach_[i].scale)});
  known_.swap(contacts_);
  find(step);
  ContactSolver::prepare(contacts_, particles_->pool());
  const auto key = [](const ContactPoint& m) { return std::tuple(m.key1, m.key2, m.feature); };
  std::ranges::sort(known_, {}, key);
  for (ContactPoint& m : contacts_) {
    auto of = std::ranges::lower_bound(known_, key(m), {}, key);
    while (of != known_.end() && key(*of) == key(m) && of->first < 0) ++of;
    if (of != known_.end() && key(*of) == key(m)) {
      m = *of;
      of->first = -1;  // taken
    } else {
      m.normal_impulse = m.tangent_impulse[0] = m.tangent_impulse[1] = 0;
    }
  }
  for (const ContactPoint& m : known_)
    if (m.first >= 0 && m.active) contacts_.push_back(m);
}

// True if two bodies that are apart at the start pass through each other on the ways on which
// impulses lead them, or may do so between two looks: the step is too long. Where contact is sought
// only free ways are looked at.
bool RigidContact::pass_through(const Step& step) {
  const double h = step.h;
  std::vector<ManifoldPoint>& points = found_[0].points;
  for (const auto& [i, j] : broad_phase_.pairs()) {
    const auto first = static_cast<std::size_t>(i), second = static_cast<std::size_t>(j);
    const Reach &one = reach_[first], &two = reach_[second];
    const SolverBody &own = solver_bodies_[first], &other = solver_bodies_[second];
    const Vec3 start = one.before.center - two.before.center,
               end = (one.after.center + own.translation) - (two.after.center + other.translation);
    const auto turned = [h](const Reach& reach, const SolverBody& moved) {
      const Vec3 free = 0.5 * h * (reach.before.angular_velocity + reach.after.angular_velocity);
      return reach.radius * (free + moved.rotation).norm();
    };
    const double path = (end - start).norm() + turned(one, own) + turned(two, other),
                 thin = std::min(body_collision_.thinness(i), body_collision_.thinness(j));
    if (path <= thin || !comes_within(one.radius + two.radius, start, end)) continue;
    if (2 * path > kMostLooks * thin) return true;
    const auto overlap = [&](double left) {
      points.clear();
      body_collision_.find_contacts(i, on_the_way(one, own, left, h), j,
                                    on_the_way(two, other, left, h), 0, points);
      double deepest = 0;
      for (const ManifoldPoint& point : points) deepest = std::max(deepest, -point.gap);
      return deepest;
    };
    const int looks = std::max(2, static_cast<int>(2 * path / thin));
    const auto passes = [&](int k) { return overlap(1 - static_cast<double>(k) / looks) > thin; };
    if (std::ranges::any_of(std::views::iota(1, looks + 1), passes) && !passes(0)) return true;
  }
  return false;
}

// Finds the contacts of one body: with colliders, then with bodies behind it, in ascending order,
// and with single particles.
void RigidContact::find_of(int body, const Step& step, Found& found) {
  const double h = step.h, end = step.t + h;
  const auto colliders = particles_->contacts().all();
  const auto reach_of = [&](int i) -> const Reach& { return reach_[static_cast<std::size_t>(i)]; };
  const auto margin_to = [&](const Reach& reach) {
    return margin_of(reach.path_length, reach.scale) + reach.pushed;
  };
  const Reach& own = reach_of(body);
  if (!own.fixed)
    for (std::size_t c = colliders.size(); c-- > 0;) {
      const Collider& solid = *colliders[c];
      const double margin =
          margin_to(own) + (solid.moves() ? 2 * h * solid.max_speed(step.t, end) : 0);
      if (solid.query(end, own.after.center).gap > own.radius + margin) continue;
      add_manifold(body, -1, static_cast<int>(c), margin, step, found,
                   [&](double left, double margin_now) {
                     body_collision_.find_contacts(body, on_the_way(reach_of(body), left, h), c,
                                                   end - left * h, margin_now, found.points);
                   });
    }
  for (const auto& [i, j] : broad_phase_.pairs_of(body)) {
    const Reach& other = reach_of(j);
    if (!SweepAndPrune::meet(balls_[static_cast<std::size_t>(i)],
                             balls_[static_cast<std::size_t>(j)]))
      continue;
    if (own.fixed && other.fixed) continue;
    add_manifold(i, j, -1, margin_to(own) + margin_to(other), step, found,
                 [&, i = i, j = j](double left, double margin) {
                   body_collision_.find_contacts(i, on_the_way(own, left, h), j,
                                                 on_the_way(other, left, h), margin, found.points);
                 });
  }
  for (const auto& [i, particle] :
       std::ranges::equal_range(particle_pairs_, body, {}, &std::pair<int, int>::first))
    touch_particle(i, particle, step, found);
}

// Threads take bodies in their order, so that each has about as many pairs; not where particles
// become solver bodies, which have the order in which they are found.
void RigidContact::find(const Step& step) {
  find_pairs();
  find_particle_pairs(step);
  ThreadPool& pool = particles_->pool();
  const int bodies = body_collision_.bodies();
  const auto pairs = broad_phase_.pairs();
  const bool shared = particle_pairs_.empty() && pairs.size() >= kManyPairs;
  const int ranks = shared ? pool.size() : 1;
  found_.resize(static_cast<std::size_t>(pool.most()));
  const auto begin_of = [&](int rank) {
    if (rank == 0 || rank == ranks) return rank == 0 ? 0 : bodies;
    return pairs[pairs.size() * static_cast<std::size_t>(rank) / static_cast<std::size_t>(ranks)]
        .first;
  };
  const auto find_some = [&](int rank) {
    Found& found = found_[static_cast<std::size_t>(rank)];
    found.contacts.clear();
    const int end = begin_of(rank + 1);
    for (int i = begin_of(rank); i < end; ++i)
      if (body_collision_.touches(i)) find_of(i, step, found);
  };
  if (shared)
    pool.run(find_some);
  else
    find_some(0);
  // Particles pushed by bodies may touch colliders; all others are resolved already.
  Found& first = found_[0];
  const int all = static_cast<int>(solver_bodies_.size());
  for (int i = bodies; i < all; ++i) {
    const Reach& reach = reach_[static_cast<std::size_t>(i)];
    if (reach.fixed) continue;
    for (std::size_t c = particles_->contacts().all().size(); c-- > 0;) {
      first.points.clear();
      body_collision_.find_contacts(i, reach.after, c, step.t + step.h,
                                    margin_of(reach.path_length, reach.scale) + reach.pushed,
                                    first.points);
      for (const ManifoldPoint& point : first.points)
        add_contact(point, i, -1, static_cast<int>(c), step, 0, first);
    }
  }
  contacts_.swap(first.contacts);
  for (int rank = 1; rank < ranks; ++rank) {
    const std::vector<ContactPoint>& more = found_[static_cast<std::size_t>(rank)].contacts;
    contacts_.insert(contacts_.end(), more.begin(), more.end());
  }
}

}  // namespace sim
