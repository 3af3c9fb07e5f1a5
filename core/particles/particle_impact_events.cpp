#include "core/particles/particle_impact_events.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/axes.h"
#include "core/particles/resting_contact.h"

namespace sim {
namespace {

constexpr double kDeep = 1e-6;     // m in units of the place: a penetration that is no error
constexpr double kMostPush = 1e6;  // m/s^2, of a surface on a particle whose bounces are faint

// The power of a contact force per mass, W/kg: `push` in m/s^2, `carrier` the velocity of the
// surface and v that of the particle.
ContactWork power_of(const Vec3& push, const Vec3& carrier, const Vec3& v) {
  const double given = push.dot(carrier);
  return {.lost = given - push.dot(v), .given = given};
}

}  // namespace

ParticleImpactEvents::ParticleImpactEvents(Particles& particles)
    : ImpactEvents(particles),
      is_held_(static_cast<std::size_t>(particles.layout().n())),
      accelerations_(particles.layout().size()) {}

void ParticleImpactEvents::evaluate(double t, const double* x) {
  const auto a = particles_->layout().axes(accelerations_.data());
  particles_->accelerate(particles_->view(t, x), a.data());
}

Vec3 ParticleImpactEvents::free_of(int i) const {
  return vector_at(particles_->layout().axes(accelerations_.data()), i);
}

RestingContactForce ParticleImpactEvents::look_at(const Held& held, const ParticleView& view,
                                                  const Vec3& free) const {
  const int i = held.particle;
  const double d = view.t < t_ + 0.5 * h_ ? kDifferenceStep * h_ : -kDifferenceStep * h_;
  return resting_contact(held.all(), view.t, d, view.position(i), view.velocity(i), free);
}

void ParticleImpactEvents::begin(double t, double h, const double* x) {
  begin_step(t, h);
  find_held(x);
}

// Finds resting contacts: particles on a surface, without normal velocity or with one that carries
// them nowhere, that are pressed to it.
void ParticleImpactEvents::find_held(const double* x) {
  for (const Held& held : held_) is_held_[static_cast<std::size_t>(held.particle)] = 0;
  held_.clear();
  const ParticleView view = particles_->view(t_, x);
  for (int i = 0; i < view.n; ++i) {
    if (!view.free(i)) continue;
    const Vec3 place = view.position(i), velocity = view.velocity(i);
    Held held{.particle = i};
    for (Collider* const collider : particles_->contacts().all()) {
      if (collider->clearance(t_, place, Vec3::Zero()) > kGapTolerance * position_scale(place))
        continue;
      const SurfaceSample sample = collider->query(t_, place);
      const double rate = (velocity - sample.velocity).dot(sample.normal);
      const double still = kVelocityTolerance * (velocity.norm() + sample.velocity.norm()) + 1e-15;
      const double slow = std::max(still, std::sqrt(2 * Contacts::slack(place) * kMostPush));
      if (std::fabs(sample.gap) > kGapTolerance * position_scale(place) || rate < -still ||
          rate > slow || is_at_edge(*collider, t_, place, velocity, sample))
        continue;
      if (held.count < 3) held.surface[held.count++] = {collider, sample.normal};
      if (rate > still) held.leaving = std::max(held.leaving, rate);
    }
    if (held.count > 0) held_.push_back(held);
  }
  if (held_.empty()) return;
  evaluate(t_, x);
  std::erase_if(held_, [&](Held& held) {
    const int i = held.particle;
    const RestingContactForce now = look_at(held, view, free_of(i));
    held.surplus = now.surplus;
    held.squeeze = now.squeeze;
    held.slip = now.slip;
    held.sticks = now.sticks;
    if (now.surplus <= kForceTolerance * now.acceleration.norm()) return true;
    // The last bounces of many are lower than rounding lets anyone see.
    const double height = 0.5 * held.leaving * held.leaving / now.surplus;
    if (height > Contacts::slack(view.position(i))) return true;
    const Vec3 carrier = held.surface[0].query(t_, view.position(i)).velocity;
    held.power = power_of(now.acceleration - free_of(i), carrier, view.velocity(i));
    is_held_[static_cast<std::size_t>(i)] = 1;
    return false;
  });
}

void ParticleImpactEvents::accelerate(const ParticleView& view, double* const a[3]) {
  if (!within(view.t)) return;
  in_forces_ = true;
  for (const Held& held : held_) {
    const int i = held.particle;
    const Vec3 kept = look_at(held, view, {a[0][i], a[1][i], a[2][i]}).acceleration;
    for (std::size_t axis = 0; axis < 3; ++axis) a[axis][i] = kept[axis];
  }
}

double ParticleImpactEvents::edge_of(const Held& held, double h, const ParticleView& before,
                                     const ParticleView& after) const {
  const int i = held.particle;
  const StepPath path = StepPath::between(h, before.position(i), before.velocity(i),
                                          after.position(i), after.velocity(i));
  double edge = 1;
  for (const SupportSurface& surface : held.all())
    edge = std::min(edge, edge_on(*surface.collider, h, path, h * free_of(i).norm()));
  return edge;
}

// Calls body(i, path) for each free particle that may touch a collider in the step.
template <class Body>
void ParticleImpactEvents::for_near(double t, double h, const double* x, const double* x_next,
                                    const Body& body) {
  const ParticleView before = particles_->view(t, x), after = particles_->view(t + h, x_next);
  for (int i = 0; i < before.n; ++i) {
    if (!before.free(i)) continue;
    const StepPath path = StepPath::between(h, before.position(i), before.velocity(i),
                                            after.position(i), after.velocity(i));
    if (particles_->contacts().near(t, h, after.position(i), Vec3::Zero(), path.length()))
      body(i, path);
  }
}

double ParticleImpactEvents::first(double t, double h, const double* x, const double* x_next) {
  Earliest earliest;
  for_near(t, h, x, x_next, [&](int i, const StepPath& path) {
    std::span<const SupportSurface> rests_on;
    if (is_held_[static_cast<std::size_t>(i)]) {
      if (!in_forces_) return;  // press() will act
      rests_on = std::ranges::lower_bound(held_, i, {}, &Held::particle)->all();
    }
    for (Collider* const collider : particles_->contacts().all()) {
      if (std::ranges::count(rests_on, collider, &SupportSurface::collider) > 0) continue;
      const double s = Contacts::first_touch(*collider, t, h, path);
      if (s > 1) continue;
      // A path that ends on the surface needs no shorter step.
      const double gap = collider->query(t + h, path.at(1)).gap;
      if (gap < -kPenetrationTolerance * position_scale(path.at(1)) ||
          gap > kGapTolerance * position_scale(path.at(1)))
        earliest.may_be(s);
      // A path that sinks in from its start on has no touch within it.
      if (s <= kMinFraction && gap < -kDeep * position_scale(path.at(1))) earliest.may_be(0.5);
    }
  });
  if (held_.empty() || !in_forces_) return earliest.s;
  evaluate(t + h, x_next);
  const ParticleView before = particles_->view(t, x), after = particles_->view(t + h, x_next);
  for (const Held& held : held_) {
    const int i = held.particle;
    earliest.may_be(edge_of(held, h, before, after));
    const RestingContactForce now = look_at(held, after, free_of(i));
    const double squeeze = std::max(held.squeeze, now.squeeze);
    if (0.5 * h * h * squeeze > kDeep * position_scale(after.position(i))) earliest.may_be(0.5);
    if (now.surplus < -1e-3 * held.surplus)
      earliest.may_be(held.surplus / (held.surplus - now.surplus));
    const double slip = held.slip.norm(), turned = now.slip.dot(held.slip);
    if (held.surface[0].collider->material().friction > 0 && !held.sticks &&
        turned < -1e-8 * slip * slip)
      earliest.may_be(slip / (slip - turned / slip));
  }
  return earliest.s;
}

Events::Outcome ParticleImpactEvents::end(double t, double h, const double* x, double* x_next,
                                          bool cut) {
  reported_work_.begin(t, h);
  bool had_impact = false;
  if (!cut || !in_forces_) had_impact = press(t, h, x, x_next, !cut);
  if (cut && in_forces_ && !held_.empty()) put_back(t, h, x, x_next);
  reported_work_.acted();
  if (bounce(t + h, x_next)) had_impact = true;
  reported_work_.happened();
  return outcome(had_impact);
}

// Corrects the drift off the surfaces that the error of the method leaves on resting particles.
void ParticleImpactEvents::put_back(double t, double h, const double* x, double* x_next) {
  evaluate(t + h, x_next);
  const ParticleView before = particles_->view(t, x), after = particles_->view(t + h, x_next);
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  for (const Held& held : held_) {
    const int i = held.particle;
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    Vec3 place = vector_at(q, i), velocity = vector_at(v, i);
    if (edge_of(held, h, before, after) < 1) {  // it lies behind
      particles_->contacts().work_sums().enter(i, mass * h, held.power);
      reported_work_.steady(held.power, mass * h);
      continue;
    }
    const RestingContactForce now = look_at(held, after, free_of(i));
    const SurfaceSample first = held.surface[0].query(t + h, place);
    const ContactWork end = power_of(now.acceleration - free_of(i), first.velocity, velocity);
    const ContactWork work{.lost = 0.5 * h * (held.power.lost + end.lost),
                           .given = 0.5 * h * (held.power.given + end.given)};
    if (now.surplus > 0)
      for (const SupportSurface& surface : held.all()) {
        const SurfaceSample sample = surface.query(t + h, place);
        place -= sample.gap * sample.normal;
        velocity -= (velocity - sample.velocity).dot(sample.normal) * sample.normal;
      }
    // A slip that is zero to the accuracy of the method ends here.
    const Vec3 slip = tangential(velocity - first.velocity, first.normal);
    if (held.surface[0].collider->material().friction > 0 &&
        (now.sticks ||
         slip.norm() <= 1e-7 * std::max(held.slip.norm(), h * now.acceleration.norm())))
      velocity -= slip;
    put_vector(q, i, place);
    put_vector(v, i, velocity);
    particles_->contacts().work_sums().enter(i, mass, work);
    reported_work_.steady(held.power, mass * h);
  }
}

// Resolves contacts within the step, as other methods do, for the resting particles or for all.
bool ParticleImpactEvents::press(double t, double h, const double* x, double* x_next, bool all) {
  const Contacts& contacts = particles_->contacts();
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  bool some = false;
  for_near(t, h, x, x_next, [&](int i, StepPath path) {
    if (!all && !is_held_[static_cast<std::size_t>(i)]) return;
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    Vec3 place = vector_at(q, i), velocity = vector_at(v, i);
    if (!contacts.resolve(t, h, i, mass, true, path, place, velocity)) return;
    put_vector(q, i, place);
    put_vector(v, i, velocity);
    some = true;
  });
  return some;
}

bool ParticleImpactEvents::bounce(double t, double* x) {
  const Contacts& contacts = particles_->contacts();
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x), v = layout.axes(x, 3);
  bool some = false;
  for (int i = 0; i < layout.n(); ++i) {
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    if (!(mass < HUGE_VAL)) continue;
    const Vec3 before = vector_at(q, i);
    if (!contacts.near(t, 0, before, Vec3::Zero(), kGapTolerance * position_scale(before)))
      continue;
    Vec3 place = before, velocity = vector_at(v, i);
    if (!contacts.push_out(t, place)) contacts.work_sums().refuse(i);
    ContactWork work;
    bool hit = false;
    // An impact on one surface may drive the particle into another that it touches.
    constexpr int kMostRounds = 100;
    bool again = true;
    for (int round = 0; round < kMostRounds && again; ++round) {
      again = false;
      for (Collider* const collider : contacts.all()) {
        const SurfaceSample sample = collider->query(t, place);
        const double rate = (velocity - sample.velocity).dot(sample.normal);
        if (sample.gap > kGapTolerance * position_scale(place) || !(rate < 0)) continue;
        const bool still = -rate <= kVelocityTolerance * (velocity.norm() + sample.velocity.norm());
        if (still && (round > 0 || is_held_[static_cast<std::size_t>(i)])) continue;
        velocity = Contacts::bounced(*collider, t, place, velocity, work);
        hit = again = true;
      }
      again = again && contacts.all().size() > 1;
    }
    if (again &&
        !contacts.lead_between(t, place, kGapTolerance * position_scale(place), velocity, work))
      contacts.work_sums().refuse(i);
    if (!hit && place == before) continue;
    put_vector(q, i, place);
    put_vector(v, i, velocity);
    contacts.work_sums().enter(i, mass, work);
    some = true;
  }
  return some;
}

}  // namespace sim
