// Which bodies may touch in a step, and where.
#include "core/particles/rigid/rigid_contact.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {
namespace {

constexpr double kNoGap = RigidContact::kNoGap;
constexpr int kMostLooks = 64;  // places at which a fast body is looked at inside a step

double radius_of(const RigidBody& body) {
  const RigidShape& shape = body.shape();
  switch (shape.form) {
    case RigidShape::Form::kSphere:
      return shape.radius;
    case RigidShape::Form::kBox:
      return shape.half.norm();
    case RigidShape::Form::kCapsule:
      return shape.radius + 0.5 * shape.length;
    case RigidShape::Form::kMesh:
      break;
  }
  double radius = 0;
  for (const Vec3& point : shape.points) radius = std::max(radius, (point - body.center()).norm());
  return radius;
}

// The least half thickness: what moves less cannot be missed.
double thinness_of(const RigidBody& body) {
  const RigidShape& shape = body.shape();
  if (shape.form == RigidShape::Form::kBox)
    return std::min(shape.half[0], std::min(shape.half[1], shape.half[2]));
  return shape.form == RigidShape::Form::kMesh ? 2 * radius_of(body) : shape.radius;
}

// How long before the end of a step of h a gap closed that is `gap` then, changes by `rate` and has
// had the acceleration a: gap - rate s + a s^2 / 2 = 0.
double time_since(double gap, double rate, double a, double h) {
  const double square = rate * rate - 2 * a * gap;
  const double q = 0.5 * (rate + std::copysign(std::sqrt(std::max(0.0, square)), rate));
  double best = h;
  for (const double s : {q != 0 ? gap / q : h, a != 0 ? 2 * q / a : h})
    if (s >= 0 && s < best) best = s;
  return best;
}

}  // namespace

RigidContact::RigidContact(std::vector<RigidBody> bodies, std::vector<Surface> surfaces,
                           Particles& particles, const double* initial)
    : bodies_(std::move(bodies)),
      surfaces_(std::move(surfaces)),
      particles_(&particles),
      reach_(bodies_.size()),
      movers_(bodies_.size()),
      moves_(bodies_.size()) {
  if (!particles.contacts().empty()) settling_.emplace(particles);
  for (std::size_t i = 0; i < bodies_.size(); ++i) reach_[i].radius = radius_of(bodies_[i]);
  check_start(initial);
}

Placed RigidContact::placed(int body, const RigidState& state) const {
  const RigidBody& of = bodies_[static_cast<std::size_t>(body)];
  return {&of.shape(), of.place(state, {}), state.axes};
}

void RigidContact::check_start(const double* initial) {
  const auto refuse = [](const std::string& why, const std::string& remedy) {
    throw Error(ErrorKind::kScene, {"contact of rigid bodies", "", why, remedy});
  };
  const auto name = [&](std::size_t i) {
    return "body " + std::to_string(i) + " (" + bodies_[i].shape().name() + ")";
  };
  const ParticleView view = particles_->view(0, initial);
  for (std::size_t i = 0; i < bodies_.size(); ++i) reach_[i].before = bodies_[i].state(view);
  const auto deepest = [&] {
    double gap = 0;
    for (const TouchPoint& point : points_) gap = std::min(gap, point.gap);
    points_.clear();
    return -gap;
  };
  constexpr double kSunk = 1e-6;  // of a radius
  const auto colliders = particles_->contacts().all();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Placed own = placed(static_cast<int>(i), reach_[i].before);
    for (Collider* const collider : colliders) {
      const SolidShape::Form form = collider->shape(0).form;
      const bool flat = form == SolidShape::Form::kPlane || form == SolidShape::Form::kNone;
      const bool round = own.shape->form == RigidShape::Form::kSphere;
      if (!flat && !round)
        refuse(name(i) + " and a collider that is no plane do not know how to touch",
               "use a plane, a room (inside = true), or a body in the shape of a sphere");
      touching(own, *collider, 0, 0, points_);
      if (const double deep = deepest(); deep > kSunk * reach_[i].radius)
        refuse(name(i) + " is " + brief(deep, 3) + " m inside a collider at the start",
               "move it out");
    }
    for (std::size_t j = i + 1; j < bodies_.size(); ++j) {
      if (!can_touch(bodies_[i].shape(), bodies_[j].shape()))
        refuse(name(i) + " and " + name(j) + " do not know how to touch",
               "give them the shape of a box, sphere or capsule");
      const Vec3 apart = reach_[i].before.center - reach_[j].before.center;
      if (apart.norm() > reach_[i].radius + reach_[j].radius) continue;
      touching(own, placed(static_cast<int>(j), reach_[j].before), 0, points_);
      const double radius = std::min(reach_[i].radius, reach_[j].radius);
      if (const double deep = deepest(); deep > kSunk * radius)
        refuse(name(i) + " and " + name(j) + " overlap by " + brief(deep, 3) + " m at the start",
               "move them apart");
    }
  }
}

void RigidContact::load(double t, double h, const double* x, const double* x_next) {
  const ParticleView from = particles_->view(t, x), to = particles_->view(t + h, x_next);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Reach& reach = reach_[i];
    const RigidBody& body = bodies_[i];
    reach.before = body.state(from);
    reach.after = body.state(to);
    const RigidState &a = reach.before, &b = reach.after;
    reach.way = h * (std::max(a.velocity.norm(), b.velocity.norm()) +
                     reach.radius * std::max(a.spin.norm(), b.spin.norm()));
    // Half a step of most methods; a whole one of symplectic Euler.
    const Vec3 gained = b.velocity - a.velocity, moved = b.center - a.center - h * a.velocity;
    const double square = gained.squaredNorm();
    reach.pulled = square > 0;
    reach.lever = reach.pulled ? std::clamp(moved.dot(gained) / square, 0.25 * h, h) : 0.5 * h;
    reach.fixed = false;
    for (int p = 0; p < RigidBody::kParticles; ++p)
      reach.fixed = reach.fixed || !to.free(body.first() + p);
    Mover& mover = movers_[i] = {};
    mover.velocity = b.velocity;
    mover.spin = b.spin;
    if (reach.fixed) continue;
    mover.inverse_mass = 1 / body.mass();
    mover.inverse_inertia = body.inverse_inertia(b);
  }
}

void RigidContact::add_meet(const TouchPoint& point, int first, int second, int collider, double t,
                            double h, double left) {
  const auto f = static_cast<std::size_t>(first);
  Meet m;
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
  double size = reach_[f].radius;
  if (second >= 0) {
    const auto s = static_cast<std::size_t>(second);
    m.arm2 = point.x - center(s);
    now -= at(reach_[s].after, m.arm2);
    before -= at(reach_[s].before, m.arm2);
    other = surfaces_[s];
    size = std::min(size, reach_[s].radius);
  } else {
    Collider& solid = *particles_->contacts().all()[static_cast<std::size_t>(collider)];
    m.ground = solid.touch(t + h, point.x).velocity;
    now -= m.ground;
    before -= solid.moves() ? solid.touch(t, point.x).velocity : m.ground;
    other = solid.surface();
  }
  m.friction = std::sqrt(surfaces_[f].friction * other.friction);
  m.restitution = std::max(surfaces_[f].restitution, other.restitution);

  // What the gap did in the step, from its end and both rates.
  const double rate = m.normal.dot(now), rate0 = m.normal.dot(before), a = (rate - rate0) / h;
  m.gap = point.gap + left * h * rate;
  const Reach& led =
      second >= 0 && !reach_[f].pulled ? reach_[static_cast<std::size_t>(second)] : reach_[f];
  const double lever = led.lever;
  const double tiny = kNoGap * size, gap0 = m.gap - h * rate0 - lever * (rate - rate0);
  if (gap0 <= tiny) {
    m.before = rate0, m.given = rate - rate0, m.after = h, m.lever = lever;
    m.active = m.gap <= tiny;
  } else {
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
  const int second = m.second >= 0 ? m.second : -1 - m.collider;
  const auto key = [](const Kept& kept) { return std::pair(kept.first, kept.second); };
  auto place = std::ranges::lower_bound(kept_, std::pair(m.first, second), {}, key);
  for (; place != kept_.end() && key(*place) == std::pair(m.first, second); ++place)
    if (place->feature == m.feature) {
      m.push = place->push;
      const Vec3& n = m.normal;
      const Vec3 pull = place->pull - n.dot(place->pull) * n;
      const double size = pull.norm(), most = m.friction * m.push;
      m.pull = size > most ? Vec3(most / size * pull) : pull;
      return;
    }
}

// Points of one pair at the end of the free step; where it is so fast that it may be through by
// then, at the first of some moments at which it touches.
template <class Touch>
void RigidContact::meet(int first, int second, int collider, double margin, double h,
                        const Touch& touch) {
  const auto f = static_cast<std::size_t>(first);
  double way = reach_[f].way, thin = thinness_of(bodies_[f]);
  if (second >= 0) {
    const auto s = static_cast<std::size_t>(second);
    way += reach_[s].way;
    thin = std::min(thin, thinness_of(bodies_[s]));
  }
  const int trials = static_cast<int>(std::clamp(2 * way / thin, 1.0, double{kMostLooks}));
  for (int k = 1; k <= trials; ++k) {
    const double left = static_cast<double>(trials - k) / trials;
    points_.clear();
    touch(left, k == trials ? margin : 0.0);
    if (points_.empty()) continue;
    for (const TouchPoint& point : points_) add_meet(point, first, second, collider, now_, h, left);
    return;
  }
}

// All pairs in ascending order.
void RigidContact::find(double t, double h) {
  meets_.clear();
  now_ = t;
  const auto colliders = particles_->contacts().all();
  const auto at = [&](int i, double left) {
    const Reach& reach = reach_[static_cast<std::size_t>(i)];
    RigidState state = reach.after;
    if (left > 0) state.center -= left * (reach.after.center - reach.before.center);
    return placed(i, state);
  };
  const auto margin_of = [&](std::size_t i) { return 2 * reach_[i].way + 1e-3 * reach_[i].radius; };
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const int first = static_cast<int>(i);
    if (!reach_[i].fixed)
      for (std::size_t c = colliders.size(); c-- > 0;) {
        const Collider& solid = *colliders[c];
        const double moved = solid.moves() ? 2 * h * solid.fastest(t, t + h) : 0;
        const double reach = reach_[i].radius + margin_of(i) + moved;
        if (solid.touch(t + h, reach_[i].after.center).gap > reach) continue;
        meet(first, -1, static_cast<int>(c), margin_of(i) + moved, h,
             [&](double left, double margin) {
               touching(at(first, left), solid, t + h - left * h, margin, points_);
             });
      }
    for (std::size_t j = i + 1; j < bodies_.size(); ++j) {
      if (reach_[i].fixed && reach_[j].fixed) continue;
      const double margin = margin_of(i) + margin_of(j);
      const double reach = reach_[i].radius + reach_[j].radius + margin;
      if ((reach_[i].after.center - reach_[j].after.center).squaredNorm() > reach * reach) continue;
      const int second = static_cast<int>(j);
      meet(first, second, -1, margin, h, [&](double left, double margin_now) {
        touching(at(first, left), at(second, left), margin_now, points_);
      });
    }
  }
}

}  // namespace sim
