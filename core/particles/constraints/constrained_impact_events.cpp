#include "core/particles/constraints/constrained_impact_events.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/axes.h"

namespace sim {
namespace {

constexpr double kGlance = 1e-6;             // s, for differences
constexpr double kSlow = 1e-12;              // m/s, a closing that is none
constexpr double kInNoTime = 1e-10;          // s
constexpr double kSticksAtLeast = 1 - 1e-3;  // of the friction limit, to its accuracy
constexpr double kStops = 1e6;               // times the present momentum: no slip withstands it

}  // namespace

ConstrainedImpactEvents::ConstrainedImpactEvents(Particles& particles,
                                                 ConstraintSystem& constraint_system)
    : ImpactEvents(particles),
      constraint_system_(&constraint_system),
      forces_(particles, constraint_system.constraints(), constraint_system.contact_count()),
      rattle_(particles, constraint_system),
      values_(constraint_system.constraints().rows()),
      accelerations_(Layout(particles.layout().n(), 3).size()) {}

void ConstrainedImpactEvents::restart() {
  ConstrainedImpactEvents fresh(*particles_, *constraint_system_);
  fresh.smooth_ = smooth_;
  *this = std::move(fresh);
}

// The difference quotient stays within the step, for which alone some surfaces were sampled, and
// does not depend on the length of the step, which is shortened by events and repeated.
ContactAccelerations::Evaluation ConstrainedImpactEvents::look_at(double t) const {
  double d = t - t_ > 3 * kGlance ? -kGlance : kGlance;
  if (particles_->contacts().sampled()) d = std::clamp(d, -0.25 * h_, 0.25 * h_);
  return {.difference_step = d, .has_friction = !smooth_};
}

bool ConstrainedImpactEvents::lies(int i, const Collider* collider) const {
  for (auto each = std::ranges::lower_bound(resting_, i, {}, &RestingContact::particle);
       each != resting_.end() && each->particle == i; ++each)
    if (each->surface.collider == collider) return true;
  return false;
}

bool ConstrainedImpactEvents::evaluate(double t, const double* x) {
  const ParticleView now = particles_->view(t, x);
  const auto a = Layout(now.n, 3).axes(accelerations_.data());
  forces_.free(now, a);
  return values_.evaluate(now, x + constraint_system_->internal_begin()) &&
         forces_.accelerate(now, values_, resting_, look_at(t), a);
}

bool ConstrainedImpactEvents::add_constraint_forces(const ParticleView& view, const double* memory,
                                                    double* const a[3]) {
  in_forces_ = true;
  return values_.evaluate(view, memory) &&
         forces_.accelerate(view, values_, resting_, look_at(view.t), {a[0], a[1], a[2]});
}

void ConstrainedImpactEvents::begin(double t, double h, const double* x) {
  begin_step(t, h);
  constraint_system_->refuse({});
  find_resting(x);
}

// Finds resting contacts: particles on a surface that do not leave it and are not about to.
void ConstrainedImpactEvents::find_resting(const double* x) {
  resting_.clear();
  pressed_.clear();
  const ParticleView view = particles_->view(t_, x);
  for (int i = 0; i < constraint_system_->contact_count(); ++i) {
    if (!view.free(i)) continue;
    const Vec3 place = view.position(i), velocity = view.velocity(i);
    for (Collider* const collider : particles_->contacts().all()) {
      if (collider->clearance(t_, place, Vec3::Zero()) > kGapTolerance * position_scale(place))
        continue;
      const SurfaceSample sample = collider->query(t_, place);
      const Vec3 relative = velocity - sample.velocity;
      const double rate = relative.dot(sample.normal);
      const double still = kVelocityTolerance * (velocity.norm() + sample.velocity.norm()) + kSlow;
      if (std::fabs(sample.gap) > kGapTolerance * position_scale(place) ||
          std::fabs(rate) > still || is_at_edge(*collider, t_, place, velocity, sample))
        continue;
      const Vec3 slip = relative - rate * sample.normal;
      resting_.push_back({.particle = i,
                          .surface = {collider, sample.normal},
                          .slides = slip.norm() > still,
                          .slip = slip});
    }
  }
  if (resting_.empty()) return;
  const auto a = Layout(view.n, 3).axes(accelerations_.data());
  const auto largest = [&] {
    double most = 0;
    for (int i = 0; i < view.n; ++i) most = std::max(most, vector_at(a, i).norm());
    return most;
  };
  // A slip that forces would build up in negligible time counts as sticking.
  forces_.free(view, a);
  const double fastest = largest();
  for (RestingContact& each : resting_)
    each.slides = each.slides && each.slip.norm() > kInNoTime * fastest;
  if (!evaluate(t_, x)) {  // f will say so
    resting_.clear();
    return;
  }
  add_power(resting_, t_, x);
  for (std::size_t k = 0; k < resting_.size(); ++k) {
    resting_[k].surplus = forces_.surplus(k);
    pressed_.push_back(std::max(0.0, forces_.contacts()[k].force));
  }
  std::size_t kept = 0;
  const double size = largest();
  for (std::size_t k = 0; k < resting_.size(); ++k) {
    if (resting_[k].surplus < -kForceTolerance * size) continue;
    resting_[kept] = resting_[k];
    pressed_[kept++] = pressed_[k];
  }
  resting_.resize(kept);
  pressed_.resize(kept);
}

void ConstrainedImpactEvents::add_power(std::span<RestingContact> resting, double t,
                                        const double* x) const {
  const ParticleView view = particles_->view(t, x);
  for (std::size_t k = 0; k < resting.size(); ++k) {
    const ContactForce& contact = forces_.contacts()[k];
    if (!contact.active) continue;
    const Vec3 force = contact.force * contact.normal + contact.friction_force;
    const double given =
        force.dot(contact.collider->query(t, view.position(contact.particle)).velocity);
    resting[k].power.given += given;
    resting[k].power.lost += given - force.dot(view.velocity(contact.particle));
  }
}

// A particle that ends on a surface needs no shorter step.
bool ConstrainedImpactEvents::at_end(double gap, const Vec3& place) const {
  return gap >= -kPenetrationTolerance * position_scale(place) &&
         gap <= kGapTolerance * position_scale(place);
}

double ConstrainedImpactEvents::first(double t, double h, const double* x, const double* x_next) {
  Earliest earliest;
  const UnilateralRattle::SubstepStates ends{t, h, x, x_next};
  const ParticleView before = particles_->view(t, x), after = particles_->view(t + h, x_next);
  if (smooth_) {
    find_others(ends);
    earliest.may_be(rattle_.next_cut());
    for (const RestingContact& each : resting_) earliest.may_be(edge_of(each, h, before, after));
    return earliest.s;
  }
  for (const int i : rattle_.near(ends)) {
    const StepPath path = StepPath::between(h, before.position(i), before.velocity(i),
                                            after.position(i), after.velocity(i));
    for (Collider* const collider : particles_->contacts().all()) {
      if (lies(i, collider)) continue;
      const double s = Contacts::first_touch(*collider, t, h, path);
      if (s <= 1 && !at_end(collider->query(t + h, path.at(1)).gap, path.at(1))) earliest.may_be(s);
    }
  }
  if (resting_.empty() || !evaluate(t + h, x_next)) return earliest.s;
  for (std::size_t k = 0; k < resting_.size(); ++k) {
    const RestingContact& each = resting_[k];
    earliest.may_be(edge_of(each, h, before, after));
    const double now = forces_.surplus(k);
    if (each.surplus > 0 && now < -1e-3 * each.surplus)
      earliest.may_be(each.surplus / (each.surplus - now));
    if (!each.slides || each.surface.collider->material().friction == 0) continue;
    const SurfaceSample sample = each.surface.query(t + h, after.position(each.particle));
    const Vec3 slip = tangential(after.velocity(each.particle) - sample.velocity, sample.normal);
    const double size = each.slip.norm(), turned = slip.dot(each.slip) / size;
    if (turned < -1e-8 * size) earliest.may_be(size / (size - turned));
  }
  return earliest.s;
}

double ConstrainedImpactEvents::edge_of(const RestingContact& contact, double h,
                                        const ParticleView& before,
                                        const ParticleView& after) const {
  const int i = contact.particle;
  const StepPath path = StepPath::between(h, before.position(i), before.velocity(i),
                                          after.position(i), after.velocity(i));
  return edge_on(*contact.surface.collider, h, path, h * contact.surplus);
}

// Finds impacts within a substep, besides resting contacts and impacts at its end.
void ConstrainedImpactEvents::find_others(const UnilateralRattle::SubstepStates& ends) {
  rattle_.find_impacts(ends);
  const ParticleView after = particles_->view(ends.t + ends.r, ends.to);
  std::erase_if(rattle_.impacts(), [&](const UnilateralRattle::Impact& impact) {
    return lies(impact.particle, impact.collider) ||
           (!impact.known && at_end(impact.gap, after.position(impact.particle)));
  });
}

Events::Outcome ConstrainedImpactEvents::end(double t, double h, const double* x, double* x_next,
                                             bool cut) {
  const UnilateralRattle::Substep substep{t, h, x, x_next, true};
  bool had_impact = false;
  reported_work_.begin(t, h);
  rattle_.impacts().clear();
  if (smooth_ || !cut) find_others(substep.ends());
  bool allowed = correct_drift(substep) && solve_substep(substep, had_impact);
  reported_work_.acted();
  if (allowed && rattle_.find_hits(t + h, x_next, kVelocityTolerance, kSlow)) {
    allowed = rattle_.solve_substep({t + h, 0, x_next, x_next, true}, 1, true);
    rattle_.record_work();
    had_impact = true;
  }
  reported_work_.happened();
  if (allowed) return outcome(had_impact);
  if (constraint_system_->refusal().empty())
    constraint_system_->refuse("constraints and colliders: this step has no end");
  return refused();
}

// Lets go of particles that have slid over an edge. The work on them is that of the start.
void ConstrainedImpactEvents::leave_edges(const UnilateralRattle::Substep& substep) {
  const ParticleView before = particles_->view(substep.t, substep.from),
                     after = particles_->view(substep.t + substep.r, substep.to);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < resting_.size(); ++k) {
    const RestingContact& each = resting_[k];
    if (edge_of(each, substep.r, before, after) < 1) {
      reported_work_.steady(each.power, substep.r);
      particles_->contacts().work_sums().enter(each.particle, substep.r, each.power);
      continue;
    }
    resting_[kept] = each;
    pressed_[kept++] = pressed_[k];
  }
  resting_.resize(kept);
  pressed_.resize(kept);
}

// Resting particles have drifted off their surfaces by the error of the method.
bool ConstrainedImpactEvents::correct_drift(const UnilateralRattle::Substep& substep) {
  const double end = substep.t + substep.r;
  contacts_.clear();
  leave_edges(substep);
  if (!resting_.empty()) {
    if (!evaluate(end, substep.to)) return false;
    const ParticleView view = particles_->view(end, substep.to);
    const auto a = Layout(view.n, 3).axes(accelerations_.data());
    for (std::size_t k = 0; k < resting_.size(); ++k)
      reported_work_.steady(resting_[k].power, substep.r);
    add_power(resting_, end, substep.to);
    double speed = 0;
    for (int i = 0; i < view.n; ++i) speed = std::max(speed, view.velocity(i).norm());
    for (std::size_t k = 0; k < resting_.size(); ++k) {
      const RestingContact& each = resting_[k];
      const ContactWork work{.lost = 0.5 * substep.r * each.power.lost,
                             .given = 0.5 * substep.r * each.power.given};
      particles_->contacts().work_sums().enter(each.particle, 1, work);
      ContactForce contact = forces_.contacts()[k];
      bool stops = false;
      pressed_[k] = 0.5 * substep.r * (pressed_[k] + std::max(0.0, contact.force));
      // A contact sticks if its slip ends here or its friction is below the Coulomb limit.
      if (contact.active && contact.friction > 0) {
        const SurfaceSample sample = each.surface.query(end, view.position(each.particle));
        const Vec3 slip = tangential(view.velocity(each.particle) - sample.velocity, sample.normal);
        const double most =
            std::max(each.slip.norm(), substep.r * vector_at(a, each.particle).norm());
        stops = each.slides
                    ? slip.norm() <= 1e-7 * most
                    : contact.friction_force.norm() < kSticksAtLeast * contact.max_friction();
        const double mass = particles_->masses()[static_cast<std::size_t>(each.particle)];
        if (stops) contact.extra_friction = kStops * mass * std::max(speed, slip.norm());
      }
      contact.friction = stops ? 1 : 0;
      contact.min_velocity = 0;
      contacts_.push_back(contact);
    }
  }
  return rattle_.correct_drift(substep, contacts_);
}

// Applies the friction of resting contacts that f leaves out, and resolves impacts that cut no
// step.
bool ConstrainedImpactEvents::solve_substep(const UnilateralRattle::Substep& substep,
                                            bool& had_impact) {
  auto& impacts = rattle_.impacts();
  bool some = std::ranges::any_of(impacts, [](const auto& m) { return !m.known; });
  if (std::ranges::any_of(impacts, &UnilateralRattle::Impact::cuts))
    particles_->contacts().work_sums().count_uncut();
  for (std::size_t k = 0; k < resting_.size(); ++k) {
    UnilateralRattle::Impact impact;
    impact.particle = resting_[k].particle, impact.collider = resting_[k].surface.collider;
    impact.normal = resting_[k].surface.normal;
    impact.known = true;
    if (smooth_ && contacts_[k].active) impact.pressed = pressed_[k];
    some = some || (impact.pressed > 0 && impact.collider->material().friction > 0);
    impacts.push_back(impact);
  }
  if (!some) return true;
  std::ranges::stable_sort(impacts, {}, &UnilateralRattle::Impact::particle);
  had_impact = true;
  if (!rattle_.solve_substep(substep, 1, false)) return false;
  rattle_.record_work();
  return true;
}

}  // namespace sim
