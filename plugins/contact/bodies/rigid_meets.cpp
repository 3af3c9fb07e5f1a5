// Which bodies may touch in a step, and where.
#include "rigid_contact.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kNoGap = RigidContact::kNoGap;
constexpr int kMostLooks = 64;  // places at which a fast body is looked at inside a step

// m, from how far a mover is looked at: what impulses may add to its way is in it.
double margin_of(double way, double radius) { return 2 * way + 1e-3 * radius; }

// Before the end of the step by a share of it.
template <class Reach>
RigidState on_the_way(const Reach& reach, double left) {
  RigidState state = reach.after;
  if (left > 0) state.center -= left * (reach.after.center - reach.before.center);
  return state;
}

}  // namespace

RigidContact::RigidContact(Solids solids, Particles& particles, Holding* holding)
    : solids_(std::move(solids)),
      particles_(&particles),
      mover_of_(static_cast<std::size_t>(solids_.singles()), -1) {
  if (holding) joints_ = std::make_unique<BodyJoints>(particles, *holding);
  if (!particles.contacts().empty() && !holding) settling_.emplace(particles);
  constexpr int kFew = 4096;  // more make room when they come
  const auto most = static_cast<std::size_t>(solids_.bodies() + std::min(kFew, solids_.singles()));
  entered_.reserve(most);
  reach_.reserve(most);
  movers_.reserve(most);
  moves_.reserve(most);
  for (int i = 0; i < solids_.bodies(); ++i)
    if (solids_.touches(i)) order_.push_back(i);
}

int RigidContact::key(int mover) const {
  const int bodies = solids_.bodies();
  if (mover < bodies) return mover;
  return bodies + entered_[static_cast<std::size_t>(mover - bodies)];
}

// From the states at both ends.
void RigidContact::measure(Reach& reach, double h) const {
  const RigidState &a = reach.before, &b = reach.after;
  reach.way = h * (std::max(a.velocity.norm(), b.velocity.norm()) +
                   reach.radius * std::max(a.spin.norm(), b.spin.norm()));
  // Half a step of most methods; a whole one of symplectic Euler.
  const Vec3 gained = b.velocity - a.velocity, moved = b.center - a.center - h * a.velocity;
  reach.gained = gained.squaredNorm();
  reach.lever =
      reach.gained > 0 ? std::clamp(moved.dot(gained) / reach.gained, 0.25 * h, h) : 0.5 * h;
}

void RigidContact::load(const Step& step) {
  const ParticleView from = particles_->view(step.t, step.x),
                     to = particles_->view(step.t + step.h, step.x_next);
  for (const int particle : entered_) mover_of_[static_cast<std::size_t>(particle)] = -1;
  entered_.clear();
  const auto bodies = static_cast<std::size_t>(solids_.bodies());
  reach_.resize(bodies);
  movers_.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) {
    Reach& reach = reach_[i];
    const RigidBody& body = solids_.body(static_cast<int>(i));
    reach.before = body.state(from);
    reach.after = body.state(to);
    reach.radius = reach.scale = solids_.radius(static_cast<int>(i));
    measure(reach, step.h);
    reach.fixed = false;
    for (int p = 0; p < RigidBody::kParticles; ++p)
      reach.fixed = reach.fixed || !to.free(body.first() + p);
    Mover& mover = movers_[i] = {};
    mover.velocity = reach.after.velocity;
    mover.spin = reach.after.spin;
    if (reach.fixed) continue;
    mover.inverse_mass = 1 / body.mass();
    mover.inverse_inertia = body.inverse_inertia(reach.after);
  }
  passed_on_ = 0;
  for (std::size_t i = 0; i < bodies; ++i)
    if (solids_.surface(static_cast<int>(i)).restitution > 0)
      passed_on_ = std::max(passed_on_, reach_[i].way);
  fastest_single_ = 0;
  for (int p = 0; p < solids_.singles(); ++p)
    fastest_single_ = std::max(
        fastest_single_, std::max(from.velocity(p).squaredNorm(), to.velocity(p).squaredNorm()));
  fastest_single_ = std::sqrt(fastest_single_);
}

// A particle near a body becomes a mover without size and turns. What presses it, presses it
// through the step as it does the body: else it would not lie still between the body and a
// collider.
int RigidContact::enter(int particle, int body, const Step& step) {
  int& mover = mover_of_[static_cast<std::size_t>(particle)];
  if (mover >= 0) return mover;
  mover = static_cast<int>(movers_.size());
  entered_.push_back(particle);
  const ParticleView from = particles_->view(step.t, step.x),
                     to = particles_->view(step.t + step.h, step.x_next);
  Reach& reach = reach_.emplace_back();
  reach.before.center = from.position(particle), reach.before.velocity = from.velocity(particle);
  reach.after.center = to.position(particle), reach.after.velocity = to.velocity(particle);
  reach.fixed = !to.free(particle);
  measure(reach, step.h);
  const Reach& near = reach_[static_cast<std::size_t>(body)];
  reach.scale = near.radius, reach.lever = near.lever, reach.gained = near.gained;
  Mover& added = movers_.emplace_back();
  added.velocity = reach.after.velocity;
  if (!reach.fixed) added.inverse_mass = 1 / to.mass[particle];
  return mover;
}

void RigidContact::add_meet(const TouchPoint& point, int first, int second, int collider,
                            const Step& step, double left) {
  const double t = step.t, h = step.h;
  const auto f = static_cast<std::size_t>(first);
  Meet m;
  m.key1 = key(first), m.key2 = second >= 0 ? key(second) : -1 - collider;
  m.first = first, m.second = second, m.collider = collider, m.feature = point.feature;
  m.normal = point.normal;
  const auto center = [&](std::size_t i) {
    return reach_[i].after.center - left * (reach_[i].after.center - reach_[i].before.center);
  };
  const auto at = [&](const RigidState& state, const Vec3& arm) {
    return state.velocity + state.spin.cross(arm);
  };
  m.arm1 = point.x + (second < 0 ? 0.5 * point.gap : 0.0) * point.normal - center(f);
  Vec3 now = at(reach_[f].after, m.arm1), before = at(reach_[f].before, m.arm1);
  Surface other;
  double size = reach_[f].scale;
  if (second >= 0) {
    const auto s = static_cast<std::size_t>(second);
    m.arm2 = point.x - center(s);
    now -= at(reach_[s].after, m.arm2);
    before -= at(reach_[s].before, m.arm2);
    other = solids_.surface(second < solids_.bodies() ? second : first);
    size = std::min(size, reach_[s].scale);
  } else {
    Collider& solid = *particles_->contacts().all()[static_cast<std::size_t>(collider)];
    m.ground = solid.touch(t + h, point.x).velocity;
    now -= m.ground;
    before -= solid.moves() ? solid.touch(t, point.x).velocity : m.ground;
    other = solid.surface();
  }
  const Surface& own = first < solids_.bodies() ? solids_.surface(first) : other;
  if (own.law || other.law) m.sides[0] = own, m.sides[1] = other;
  m.friction = std::sqrt(own.friction * other.friction);
  if (m.has_law()) m.friction = m.friction_at(tangential(before, m.normal).norm());
  m.restitution = std::max(own.restitution, other.restitution);

  // What the gap did in the step, from its end and both rates.
  const double rate = m.normal.dot(now), rate0 = m.normal.dot(before), a = (rate - rate0) / h;
  m.gap = point.gap + left * h * rate;
  // Of the one that is not held in place.
  constexpr double kHeld = 1e-6;
  const Reach* led = &reach_[f];
  if (second >= 0)
    if (const Reach& with = reach_[static_cast<std::size_t>(second)];
        reach_[f].gained <= kHeld * with.gained)
      led = &with;
  const double lever = led->lever;
  const double tiny = m.tiny = kNoGap * size, gap0 = m.gap - h * rate0 - lever * (rate - rate0);
  if (gap0 <= tiny) {
    m.before = rate0, m.given = rate - rate0, m.after = h, m.lever = lever;
    m.path_gap = gap0 + h * rate0, m.path_gain = m.given;
    m.active = m.gap <= tiny;
  } else {
    m.path_gap = m.gap, m.acceleration = a;
    m.active = m.gap < 0;
    m.after = m.active ? time_since(m.gap, rate, a, h) : 0;
    m.given = a * m.after;
    m.before = rate - m.given;
    m.lever = rate < 0 ? std::clamp(m.gap / rate, 0.0, h) : lever;
  }
  // Arms of the moment at which it acts, from one point, so that angular momentum stays.
  if (second >= 0) {
    const RigidState &one = reach_[f].after, &two = reach_[static_cast<std::size_t>(second)].after;
    const Vec3 drift = 0.5 * (at(one, m.arm1) + at(two, m.arm2));
    m.arm1 += m.lever * (one.velocity - drift);
    m.arm2 += m.lever * (two.velocity - drift);
  }
  remember(m);
  meets_.push_back(m);
}

// The impulses that it had in the step before.
void RigidContact::remember(Meet& m) const {
  const auto key = [](const Kept& kept) { return std::pair(kept.first, kept.second); };
  const std::pair own(m.key1, m.key2);
  auto place = std::ranges::lower_bound(kept_, own, {}, key);
  for (; place != kept_.end() && key(*place) == own; ++place)
    if (place->feature == m.feature) {
      m.push = place->push;
      const Vec3& n = m.normal;
      const Vec3 pull = place->pull - n.dot(place->pull) * n;
      m.pull = within_cone(pull, m.friction * m.push);
      return;
    }
}

// Points of one pair at the end of the free step; where it is so fast that it may be through by
// then, at the first of some moments at which it touches.
template <class Touching>
void RigidContact::meet(int first, int second, int collider, double margin, const Step& step,
                        const Touching& touching) {
  double way = reach_[static_cast<std::size_t>(first)].way, thin = solids_.thinness(first);
  if (second >= 0) {
    way += reach_[static_cast<std::size_t>(second)].way;
    if (second < solids_.bodies()) thin = std::min(thin, solids_.thinness(second));
  }
  const int trials = static_cast<int>(std::clamp(2 * way / thin, 1.0, double{kMostLooks}));
  for (int k = 1; k <= trials; ++k) {
    const double left = static_cast<double>(trials - k) / trials;
    points_.clear();
    touching(left, k == trials ? margin : 0.0);
    if (points_.empty()) continue;
    for (const TouchPoint& point : points_) add_meet(point, first, second, collider, step, left);
    return;
  }
}

// Bodies whose balls may touch: those whose shadows on the x axis overlap are looked at.
void RigidContact::find_pairs() {
  pairs_.clear();
  const auto span = [&](int i) {
    const Reach& reach = reach_[static_cast<std::size_t>(i)];
    return reach.radius + margin_of(reach.way, reach.radius) + passed_on_;
  };
  const auto middle = [&](int i) { return reach_[static_cast<std::size_t>(i)].after.center; };
  // Nearly sorted since the step before.
  const auto low = [&](int i) { return middle(i).x() - span(i); };
  for (std::size_t k = 1; k < order_.size(); ++k)
    for (std::size_t j = k; j > 0 && low(order_[j]) < low(order_[j - 1]); --j)
      std::swap(order_[j], order_[j - 1]);
  for (std::size_t k = 0; k < order_.size(); ++k) {
    const int i = order_[k];
    const double high = middle(i).x() + span(i);
    for (std::size_t l = k + 1; l < order_.size() && !(low(order_[l]) > high); ++l) {
      const int j = order_[l];
      if (solids_.are_joined(i, j)) continue;
      const double reach = span(i) + span(j);
      if ((middle(i) - middle(j)).squaredNorm() > reach * reach) continue;
      pairs_.emplace_back(std::min(i, j), std::max(i, j));
    }
  }
  std::ranges::sort(pairs_);
}

// Single particles that may touch a body.
void RigidContact::find_particles(int body, const Step& step) {
  const Reach own = reach_[static_cast<std::size_t>(body)];
  const Vec3 center = own.after.center;
  const double most = own.radius + margin_of(own.way, own.radius) + 2 * step.h * fastest_single_;
  const ParticleView to = particles_->view(step.t + step.h, step.x_next);
  for (int p = 0; p < solids_.singles(); ++p) {
    if ((to.position(p) - center).squaredNorm() > most * most) continue;
    if (solids_.are_tied(body, p) || (own.fixed && !to.free(p))) continue;
    const int second = enter(p, body, step);
    const double way = reach_[static_cast<std::size_t>(second)].way;
    meet(body, second, -1, margin_of(own.way + way, own.radius), step,
         [&](double left, double margin) {
           solids_.touch(body, on_the_way(reach_[static_cast<std::size_t>(body)], left), second,
                         on_the_way(reach_[static_cast<std::size_t>(second)], left), margin,
                         points_);
         });
  }
}

// All pairs in ascending order; of each mover first those with colliders, then those with others.
void RigidContact::find(const Step& step) {
  meets_.clear();
  const double h = step.h, end = step.t + h;
  const auto colliders = particles_->contacts().all();
  const auto reach_of = [&](int i) -> const Reach& { return reach_[static_cast<std::size_t>(i)]; };
  const auto margin_to = [&](const Reach& reach) { return margin_of(reach.way, reach.scale); };
  find_pairs();
  auto pair = pairs_.cbegin();
  for (int i = 0; i < solids_.bodies(); ++i) {
    if (!solids_.touches(i)) continue;
    if (!reach_of(i).fixed)
      for (std::size_t c = colliders.size(); c-- > 0;) {
        const Collider& solid = *colliders[c];
        const double margin =
            margin_to(reach_of(i)) + (solid.moves() ? 2 * h * solid.fastest(step.t, end) : 0);
        if (solid.touch(end, reach_of(i).after.center).gap > reach_of(i).radius + margin) continue;
        meet(i, -1, static_cast<int>(c), margin, step, [&](double left, double margin_now) {
          solids_.touch(i, on_the_way(reach_of(i), left), c, end - left * h, margin_now, points_);
        });
      }
    for (; pair != pairs_.cend() && pair->first == i; ++pair) {
      const int j = pair->second;
      if (reach_of(i).fixed && reach_of(j).fixed) continue;
      meet(i, j, -1, margin_to(reach_of(i)) + margin_to(reach_of(j)) + 2 * passed_on_, step,
           [&](double left, double margin) {
             solids_.touch(i, on_the_way(reach_of(i), left), j, on_the_way(reach_of(j), left),
                           margin, points_);
           });
    }
    find_particles(i, step);
  }
  // What bodies push may meet colliders; where these let it be, it is settled already.
  const int all = static_cast<int>(movers_.size());
  for (int i = solids_.bodies(); i < all; ++i) {
    if (reach_of(i).fixed) continue;
    for (std::size_t c = colliders.size(); c-- > 0;) {
      points_.clear();
      solids_.touch(i, reach_of(i).after, c, end, margin_to(reach_of(i)), points_);
      for (const TouchPoint& point : points_) add_meet(point, i, -1, static_cast<int>(c), step, 0);
    }
  }
}

}  // namespace sim
