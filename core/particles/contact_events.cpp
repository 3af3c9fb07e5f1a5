#include "core/particles/contact_events.h"

#include <algorithm>
#include <cmath>

#include "core/particles/axes.h"
#include "core/particles/pressed.h"

namespace sim {
namespace {

constexpr double kOn = 1e-9;     // m in units of the place: a gap that counts as none at an end
constexpr double kIn = 1e-11;    // likewise, and less than none
constexpr double kStill = 1e-9;  // of velocities: a rate of the gap that counts as none
constexpr double kLeastShare = 1e-9;  // shares of a step that are none
constexpr double kPressed = 1e-7;     // of the acceleration: a push that is none

Vec3 along(const Vec3& v, const Vec3& normal) { return v - v.dot(normal) * normal; }

}  // namespace

ContactEvents::ContactEvents(Particles& particles)
    : particles_(&particles),
      is_held_(static_cast<std::size_t>(particles.layout().n())),
      accelerations_(particles.layout().size()) {}

void ContactEvents::evaluate(double t, const double* x) {
  const auto a = particles_->layout().axes(accelerations_.data());
  particles_->accelerate(particles_->view(t, x), a.data());
}

Pressed ContactEvents::look_at(const Held& held, const ParticleView& view) {
  const auto a = particles_->layout().axes(accelerations_.data());
  const int i = held.particle;
  const double d = view.t < t_ + 0.5 * h_ ? kGlimpse * h_ : -kGlimpse * h_;
  return pressed_on(held.all(), view.t, d, view.position(i), view.velocity(i),
                    {a[0][i], a[1][i], a[2][i]});
}

void ContactEvents::begin(double t, double h, const double* x) {
  t_ = t;
  h_ = h;
  begun_ = true;
  in_forces_ = false;
  const Contacts& contacts = particles_->contacts();
  contacts.ledger().begin_step();
  if (contacts.sampled()) contacts.look(t, t + h);
  find_held(x);
}

// What lies on a surface, does not move off it, and is pressed to it.
void ContactEvents::find_held(const double* x) {
  for (const Held& held : held_) is_held_[static_cast<std::size_t>(held.particle)] = 0;
  held_.clear();
  const ParticleView view = particles_->view(t_, x);
  for (int i = 0; i < view.n; ++i) {
    if (!view.free(i)) continue;
    const Vec3 place = view.position(i), velocity = view.velocity(i);
    Held held{.particle = i};
    for (Collider* const collider : particles_->contacts().all()) {
      if (collider->clearance(t_, place, Vec3::Zero()) > kOn * place_size(place)) continue;
      const Touch touch = collider->touch(t_, place);
      const double rate = (velocity - touch.velocity).dot(touch.normal);
      const double still = kStill * (velocity.norm() + touch.velocity.norm()) + 1e-15;
      if (std::fabs(touch.gap) > kOn * place_size(place) || std::fabs(rate) > still) continue;
      if (held.count < 3) held.collider[held.count++] = collider;
    }
    if (held.count > 0) held_.push_back(held);
  }
  if (held_.empty()) return;
  evaluate(t_, x);
  std::erase_if(held_, [&](Held& held) {
    const Pressed now = look_at(held, view);
    held.surplus = now.surplus;
    held.slip = now.slip;
    if (now.surplus <= kPressed * now.acceleration.norm()) return true;
    const Vec3 carrier = held.collider[0]->touch(t_, view.position(held.particle)).velocity;
    const auto a = particles_->layout().axes(accelerations_.data());
    const int i = held.particle;
    const Vec3 force = now.acceleration - Vec3(a[0][i], a[1][i], a[2][i]);
    held.given = force.dot(carrier);
    held.lost = held.given - force.dot(view.velocity(i));
    is_held_[static_cast<std::size_t>(i)] = 1;
    return false;
  });
}

void ContactEvents::accelerate(const ParticleView& view, double* const a[3]) {
  if (!begun_ || !(view.t >= t_ && view.t <= t_ + h_)) return;
  in_forces_ = true;
  const double d = view.t < t_ + 0.5 * h_ ? kGlimpse * h_ : -kGlimpse * h_;
  for (const Held& held : held_) {
    const int i = held.particle;
    const Vec3 kept = pressed_on(held.all(), view.t, d, view.position(i), view.velocity(i),
                                 {a[0][i], a[1][i], a[2][i]})
                          .acceleration;
    for (std::size_t axis = 0; axis < 3; ++axis) a[axis][i] = kept[axis];
  }
}

// body(i, way) of all free particles that may touch something in the step.
template <class Body>
void ContactEvents::for_near(double t, double h, const double* x, const double* x_next,
                             const Body& body) {
  const ParticleView before = particles_->view(t, x), after = particles_->view(t + h, x_next);
  for (int i = 0; i < before.n; ++i) {
    if (!before.free(i)) continue;
    const Vec3 x0 = before.position(i), r0 = h * before.velocity(i), r1 = h * after.velocity(i);
    const Vec3 way_to = after.position(i) - x0;
    const Way way{{x0, r0, 3 * way_to - 2 * r0 - r1, r0 + r1 - 2 * way_to}};
    if (particles_->contacts().near(t, h, after.position(i), Vec3::Zero(), way.length()))
      body(i, way);
  }
}

double ContactEvents::first(double t, double h, const double* x, const double* x_next) {
  double earliest = 1;
  const auto may_be = [&earliest](double s) {
    if (s > kLeastShare && s < earliest && s < 1 - kLeastShare) earliest = s;
  };
  for_near(t, h, x, x_next, [&](int i, const Way& way) {
    if (is_held_[static_cast<std::size_t>(i)]) return;
    for (Collider* const collider : particles_->contacts().all()) {
      const double s = Contacts::first_touch(*collider, t, h, way);
      if (s > 1) continue;
      // What ends on the surface needs no shorter step.
      const double gap = collider->touch(t + h, way.at(1)).gap;
      if (gap < -kIn * place_size(way.at(1)) || gap > kOn * place_size(way.at(1))) may_be(s);
    }
  });
  if (held_.empty() || !in_forces_) return earliest;
  evaluate(t + h, x_next);
  const ParticleView after = particles_->view(t + h, x_next);
  for (const Held& held : held_) {
    const Pressed now = look_at(held, after);
    if (now.surplus < -1e-3 * held.surplus) may_be(held.surplus / (held.surplus - now.surplus));
    const double before = held.slip.norm(), turned = now.slip.dot(held.slip);
    if (held.collider[0]->surface().friction > 0 && turned < -1e-8 * before * before)
      may_be(before / (before - turned / before));
  }
  return earliest;
}

Events::Outcome ContactEvents::end(double t, double h, const double* x, double* x_next, bool cut) {
  bool jumped = false;
  if (!cut || !in_forces_) jumped = press(t, h, x, x_next, !cut);
  if (cut && in_forces_ && !held_.empty()) put_back(t, h, x_next);
  if (bounce(t + h, x_next)) jumped = true;
  if (particles_->contacts().ledger().squeezed() >= 0) return Outcome::kNotAllowed;
  return jumped ? Outcome::kJumped : Outcome::kSmooth;
}

// What is held has drifted off its surface by what the method is off.
bool ContactEvents::put_back(double t, double h, double* x) {
  evaluate(t + h, x);
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x), v = layout.axes(x, 3);
  const auto a = layout.axes(accelerations_.data());
  for (const Held& held : held_) {
    const int i = held.particle;
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    const Pressed now = look_at(held, particles_->view(t + h, x));
    Vec3 place(q[0][i], q[1][i], q[2][i]), velocity(v[0][i], v[1][i], v[2][i]);
    const Touch first = held.collider[0]->touch(t + h, place);
    const Vec3 force = now.acceleration - Vec3(a[0][i], a[1][i], a[2][i]);
    const double given = force.dot(first.velocity), lost = given - force.dot(velocity);
    ContactWork work{.lost = 0.5 * h * (held.lost + lost), .given = 0.5 * h * (held.given + given)};
    if (now.surplus > 0)
      for (Collider* const collider : held.all()) {
        const Touch touch = collider->touch(t + h, place);
        place -= touch.gap * touch.normal;
        velocity -= (velocity - touch.velocity).dot(touch.normal) * touch.normal;
      }
    // A slip that ends here.
    const Vec3 slip = along(velocity - first.velocity, first.normal);
    if (held.collider[0]->surface().friction > 0 &&
        slip.norm() <= 1e-7 * std::max(held.slip.norm(), h * now.acceleration.norm()))
      velocity -= slip;
    put_vector(q, i, place);
    put_vector(v, i, velocity);
    particles_->contacts().ledger().enter(i, mass, work);
  }
  return true;
}

// As in the steps of other methods: of those that are held, or of all.
bool ContactEvents::press(double t, double h, const double* x, double* x_next, bool all) {
  const Contacts& contacts = particles_->contacts();
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  bool some = false;
  for_near(t, h, x, x_next, [&](int i, Way way) {
    if (!all && !is_held_[static_cast<std::size_t>(i)]) return;
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    contacts.settle(t, h, way);
    if (!way.touched) return;
    if (way.squeezed) contacts.ledger().refuse(i);
    const Vec3 place = way.stuck ? way.held : Vec3(Vec3(q[0][i], q[1][i], q[2][i]) + way.moved);
    Vec3 velocity = Vec3(v[0][i], v[1][i], v[2][i]) + way.kicked / h;
    contacts.ledger().enter(i, mass / (h * h), way.work);
    if (way.pressed) {
      ContactWork work;
      velocity = contacts.hold(t + h, place, velocity, work);
      contacts.ledger().enter(i, mass, work);
    }
    put_vector(q, i, place);
    put_vector(v, i, velocity);
    some = true;
  });
  return some;
}

bool ContactEvents::bounce(double t, double* x) {
  const Contacts& contacts = particles_->contacts();
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x), v = layout.axes(x, 3);
  bool some = false;
  for (int i = 0; i < layout.n(); ++i) {
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    if (!(mass < HUGE_VAL)) continue;
    const Vec3 before(q[0][i], q[1][i], q[2][i]);
    if (!contacts.near(t, 0, before, Vec3::Zero(), kOn * place_size(before))) continue;
    Vec3 place = before, velocity(v[0][i], v[1][i], v[2][i]);
    if (!contacts.push_out(t, place)) contacts.ledger().refuse(i);
    ContactWork work;
    bool hit = false;
    for (Collider* const collider : contacts.all()) {
      const Touch touch = collider->touch(t, place);
      const double rate = (velocity - touch.velocity).dot(touch.normal);
      if (touch.gap > kOn * place_size(place) || !(rate < 0)) continue;
      const bool still = -rate <= kStill * (velocity.norm() + touch.velocity.norm());
      if (still && is_held_[static_cast<std::size_t>(i)]) continue;
      velocity = Contacts::bounced(*collider, t, place, velocity, work);
      hit = true;
    }
    if (!hit && place == before) continue;
    put_vector(q, i, place);
    put_vector(v, i, velocity);
    contacts.ledger().enter(i, mass, work);
    some = true;
  }
  return some;
}

}  // namespace sim
