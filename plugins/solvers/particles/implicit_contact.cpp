#include "implicit_contact.h"

#include <algorithm>
#include <cmath>

#include "core/math/axes.h"
#include "core/particles/resting_contact.h"

namespace sim {
namespace {

constexpr int kMostRounds = 10;
constexpr int kMostFlips = 1;        // between sticking and sliding
constexpr double kTouching = 1e-12;  // m, of a gap, in units of the place
constexpr double kSlower = 0.1;      // of the last slip, if friction would reverse it
constexpr double kLoosely = 1e-9;    // if friction is iterated in rounds
constexpr double kFriction = 1e-4;   // of its changes from round to round
constexpr double kAtRest = 1e-12;    // of velocities, below which they are rounding
constexpr double kNowhere = -1e300;  // m/s, a bound that is none

}  // namespace

ImplicitContact::ImplicitContact(Particles& particles)
    : particles_(&particles), index_(static_cast<std::size_t>(particles.layout().n()), -1) {}

ImplicitContact::Held* ImplicitContact::held(int i) {
  const int index = index_[static_cast<std::size_t>(i)];
  return index < 0 ? nullptr : &held_[static_cast<std::size_t>(index)];
}

ImplicitContact::Held& ImplicitContact::entered(int i) {
  if (Held* const known = held(i)) return *known;
  index_[static_cast<std::size_t>(i)] = static_cast<int>(held_.size());
  return held_.emplace_back(Held{.particle = i});
}

std::span<Collider* const> ImplicitContact::colliders_at(int i) {
  const Held* const known = held(i);
  return known ? known->all() : std::span<Collider* const>();
}

Vec3 ImplicitContact::surface_velocity(const Held& held, double t, const Vec3& x) const {
  return held.collider[0]->query(t, x).velocity;
}

const double* ImplicitContact::begin(double t, double h, const double* x, bool again) {
  stage_ = 0;
  again_ = false;
  if (again) {
    ++round_;
    return from_;
  }
  t_ = t;
  h_ = h;
  round_ = 0;
  had_impact_ = false;
  from_ = x;
  begun_ = true;
  for (const Held& held : held_) index_[static_cast<std::size_t>(held.particle)] = -1;
  held_.clear();
  blows_.clear();
  for (Stage& stage : stages_) {
    stage.bounds.clear();
    stage.velocity.clear();
    stage.friction.clear();
  }
  const Contacts& contacts = particles_->contacts();
  if (contacts.empty()) return x;
  contacts.work_sums().begin_step();
  if (contacts.sampled()) contacts.prepare_interval(t, t + h);
  if (contacts.accuracy() != Accuracy::kProject) find_held(x);
  return from_;
}

// Finds the resting contacts; a particle that approaches its surface is an impact and bounces at
// once.
void ImplicitContact::find_held(const double* x) {
  const Layout& layout = particles_->layout();
  const ParticleView view = particles_->view(t_, x);
  for (int i = 0; i < layout.n(); ++i) {
    if (!view.free(i)) continue;
    const Vec3 place = view.position(i);
    for (Collider* const collider : particles_->contacts().all()) {
      if (collider->clearance(t_, place, Vec3::Zero()) > kTouching * position_scale(place))
        continue;
      const SurfaceSample sample = collider->query(t_, place);
      if (sample.gap > Contacts::slack(place)) continue;
      const Vec3 velocity = view.velocity(i), slip = velocity - sample.velocity;
      if (slip.dot(sample.normal) < -kAtRest * (velocity.norm() + sample.velocity.norm()) ||
          sample.gap < -1e3 * kTouching * position_scale(place)) {
        const StepPath path{{place, h_ * velocity, Vec3::Zero(), Vec3::Zero()}};
        Contacts::Impact impact;
        if (particles_->contacts().impact(t_, h_, path, colliders_at(i), impact)) {
          hit(i, impact);
          continue;
        }
      }
      const bool first = !held(i);
      Held& known = entered(i);
      if (first) known.sticking_since = t_, known.place = place;
      if (known.count == VelocityInequality::kMost) continue;
      known.add(collider, t_);
      const Vec3 along = tangential(slip, sample.normal);
      known.sticking = collider->material().friction > 0 && known.count == 1 &&
                       along.norm() <= kAtRest * (velocity.norm() + sample.velocity.norm());
    }
  }
}

// Moves the start of the stages to where a particle with the velocity after the impact would have
// come from.
void ImplicitContact::hit(int i, const Contacts::Impact& impact) {
  const Layout& layout = particles_->layout();
  const double mass = particles_->masses()[static_cast<std::size_t>(i)];
  if (!had_impact_) {
    if (start_.size() < layout.size() + particles_->internal_size())
      start_ = Array(layout.size() + particles_->internal_size());
    std::copy_n(from_, start_.size(), start_.data());
    from_ = start_.data();
    had_impact_ = true;
  }
  const auto q = layout.axes(start_.data()), v = layout.axes(start_.data(), 3);
  Held& known = entered(i);
  known.add(impact.collider, t_ + impact.s * h_);
  known.sticking = false;
  known.sticking_since = t_ + impact.s * h_;
  known.place = impact.place;
  const Vec3 shift = impact.shift - impact.s * impact.change;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    q[axis][i] += shift[axis];
    v[axis][i] += impact.change[axis] / h_;
  }
  const double scale = mass / (h_ * h_);
  blows_.push_back({i, {scale * impact.work.lost, scale * impact.work.given}});
}

VelocityInequalities* ImplicitContact::bounds(double t, double tau, const StageOptions& method,
                                              const double* r) {
  if (held_.empty()) return nullptr;
  if (stages_.size() <= stage_) stages_.emplace_back();
  Stage& stage = stages_[stage_];
  stage.t = t;
  stage.tau = tau;
  stage.reach = method.reach;
  stage.first_order = method.order == 1;
  stage.r = r;
  const Layout& layout = particles_->layout();
  const auto rq = layout.axes(r), v = layout.axes(from_, 3);
  const double span = stage.span(), end = stage.end();
  for (std::size_t n = 0; n < held_.size(); ++n) {
    const Held& held = held_[n];
    const int i = held.particle;
    if (stage.bounds.size() <= n) {
      stage.bounds.emplace_back();
      stage.velocity.push_back(vector_at(v, i));
      stage.friction.emplace_back();
    }
    VelocityInequality& bound = stage.bounds[n];
    const Vec3 velocity = stage.velocity[n], origin = vector_at(rq, i);
    bound.particle = i;
    bound.count = held.count;
    bound.active = 0;
    bound.sticking = held.sticking && held.sticking_since <= end;
    bound.friction_model = held.sticking ? Friction{} : stage.friction[n];
    if (bound.sticking)
      bound.held = (held.collider[0]->advect(held.sticking_since, end, held.place) - origin) / span;
    for (int k = 0; k < held.count; ++k) {
      const SurfaceSample there = held.collider[k]->query(t, origin + tau * velocity);
      const SurfaceSample after = held.collider[k]->query(end, origin + span * velocity);
      const double along = std::max(there.normal.dot(after.normal), 0.1);
      bound.planes[k] = {
          there.normal,
          held.since[k] > end ? kNowhere : there.normal.dot(velocity) - after.gap / (span * along)};
    }
  }
  return &stage.bounds;
}

void ImplicitContact::solved(const double* y) {
  if (held_.empty()) return;
  Stage& stage = stages_[stage_++];
  const auto v = particles_->layout().axes(y, 3), rq = particles_->layout().axes(stage.r);
  const double span = stage.span(), end = stage.end();
  for (std::size_t n = 0; n < held_.size(); ++n) {
    const Held& held = held_[n];
    const VelocityInequality& bound = stage.bounds[n];
    const Vec3 velocity = vector_at(v, held.particle);
    const Vec3 place = vector_at(rq, held.particle) + span * velocity;
    stage.velocity[n] = velocity;
    linearise_friction(stage, n);
    for (int k = 0; k < held.count && !bound.sticking; ++k) {
      if (held.since[k] > end) continue;
      const double gap = held.collider[k]->query(end, place).gap;
      const bool pushes = bound.active >> k & 1;
      const double touching =
          (bound.friction_model.drag > 0 ? kLoosely : kTouching) * position_scale(place);
      if (gap < -touching || (pushes && gap > touching)) again_ = true;
    }
  }
}

// Linearises friction for the next round from the normal impulse and the slip of this one. A slip
// that friction would reverse ends: the particle sticks or, if it has switched too often, gets a
// viscous drag.
void ImplicitContact::linearise_friction(Stage& stage, std::size_t index) {
  Held& held = held_[index];
  const VelocityInequality& bound = stage.bounds[index];
  const int i = held.particle;
  const Vec3 normal = bound.planes[0].normal, velocity = stage.velocity[index];
  const Layout& layout = particles_->layout();
  const Vec3 place = vector_at(layout.axes(stage.r), i) + stage.tau * velocity;
  const Vec3 carrier = surface_velocity(held, stage.t, place);
  const Vec3 slip = tangential(velocity - carrier, normal);
  const double speed = slip.norm();
  double most = 0;  // of friction, kg m/s
  for (int k = 0; k < held.count; ++k) {
    const double push =
        bound.sticking ? std::max(0.0, bound.push.dot(bound.planes[k].normal)) : bound.pushes[k];
    most =
        std::max(most, held.collider[k]->material().friction_at(bound.sticking ? 0 : speed) * push);
  }
  Friction& friction = stage.friction[index];
  const auto turn = [&](bool sticking) {
    if (held.turns > 2 * kMostFlips) return false;
    ++held.turns;
    held.sticking = sticking;
    return again_ = true;
  };
  const auto slides = [&](const Vec3& path) {
    const double size = path.norm();
    friction = {most / size, path / size, most, normal, carrier};
  };
  if (bound.sticking) {
    Vec3 along = bound.push;  // without the normal part
    for (int k = 0; k < held.count; ++k)
      along -= along.dot(bound.planes[k].normal) * bound.planes[k].normal;
    if (along.norm() <= most) return;
    if (round_ == 0) {  // the parts tied to it have slipped without friction so far
      again_ = true;
      return;
    }
    // The particle slips, at first as fast as without the springs and rods that hold it.
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    slides((most / along.norm() - 1) / mass * along);
    turn(false);
    return;
  }
  if (most == 0 && friction.drag == 0) return;
  const Vec3 before = vector_at(layout.axes(stage.r, 3), i);
  const double end = stage.end();
  const Vec3 last = tangential(
      before + stage.reach * (velocity - before) - surface_velocity(held, end, place), normal);
  const bool turns_round =
      friction.drag > 0 && (last.dot(bound.friction) < 0 || slip.dot(friction.direction) < 0);
  // A slip that friction could end so many times over is none, however slow all of it is.
  const double mass = particles_->masses()[static_cast<std::size_t>(i)];
  const double still = kAtRest * (velocity.norm() + most / mass);
  if (most > 0 && (turns_round || speed <= still) && turn(true)) return;
  const Vec3 wanted = speed > 0 ? Vec3(most / speed * slip) : Vec3::Zero();
  if ((wanted - bound.friction).norm() > kFriction * most) again_ = true;
  if (speed == 0 || most == 0)
    friction = {};
  else if (speed <= still)
    friction = {most / still, Vec3::Zero(), 0, normal, carrier};
  else if (turns_round || (friction.drag > 0 && friction.size == 0))
    friction = {most / (turns_round ? kSlower * most / friction.drag : speed), Vec3::Zero(), 0,
                normal, carrier};
  else
    slides(slip);
}

// Finds impacts on the path to x_next that were not known; true if there are any.
bool ImplicitContact::find_impacts(const double* x_next) {
  const Contacts& contacts = particles_->contacts();
  const Layout& layout = particles_->layout();
  const ParticleView before = particles_->view(t_, from_), after = particles_->view(t_, x_next);
  bool found = false;
  for (int i = 0; i < layout.n(); ++i) {
    if (!before.free(i)) continue;
    const StepPath path = StepPath::between(h_, before.position(i), before.velocity(i),
                                            after.position(i), after.velocity(i));
    if (!contacts.near(t_, h_, after.position(i), Vec3::Zero(), path.length())) continue;
    const Held* const known = held(i);
    if (known && known->count == VelocityInequality::kMost) continue;
    Contacts::Impact impact;
    if (!contacts.impact(t_, h_, path, colliders_at(i), impact)) continue;
    hit(i, impact);
    found = true;
  }
  return found;
}

StepEnd ImplicitContact::end(double* x_next, bool bounces) {
  begun_ = false;
  const Contacts& contacts = particles_->contacts();
  if (contacts.empty()) return StepEnd::kAccepted;
  const bool project = contacts.accuracy() == Accuracy::kProject;
  if (!project && round_ < kMostRounds && ((bounces && find_impacts(x_next)) || again_)) {
    begun_ = true;
    return StepEnd::kAgain;
  }
  finish(x_next);
  if (bounces) put_out(x_next, project);
  return contacts.work_sums().over_constrained() < 0 ? StepEnd::kAccepted : StepEnd::kNotAllowed;
}

void ImplicitContact::finish(double* x_next) {
  const Contacts& contacts = particles_->contacts();
  ContactWorkSums& work_sums = contacts.work_sums();
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  const auto q0 = layout.axes(from_);
  const double end = t_ + h_;
  for (const auto& [i, work] : blows_) work_sums.enter(i, 1, work);
  for (std::size_t n = 0; n < held_.size(); ++n) {
    const Held& held = held_[n];
    const int i = held.particle;
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    const Stage& stage = stages_[stage_ - 1];
    const VelocityInequality& bound = stage.bounds[n];
    if (bound.active == 0) continue;
    // The contact force through the step: normal force and friction.
    const Vec3 force = (bound.push - bound.friction) / stage.tau;
    Vec3 place = vector_at(q, i), velocity = vector_at(v, i);
    const Vec3 moved = place - vector_at(q0, i);
    const Vec3 surface = surface_velocity(held, stage.t, place);
    ContactWork work{.given = h_ * force.dot(surface)};
    work.lost = work.given - force.dot(moved);

    const auto change_to = [&](const Vec3& wanted, const Vec3& carrier) {
      const Vec3 change = wanted - velocity;
      work.given += mass * change.dot(carrier);
      work.lost += mass * change.dot(carrier - 0.5 * (wanted + velocity));
      velocity = wanted;
    };
    if (bound.sticking) {
      place = held.collider[0]->advect(held.sticking_since, end, held.place);
      const Vec3 carrier = surface_velocity(held, end, place);
      change_to(carrier, carrier);
    } else {
      // An active contact at the end allows no separating velocity either, and friction is limited
      // by the total normal impulse; but the velocity of a method of first order is that of the
      // chord, which may separate.
      for (int round = 0; round < 8; ++round)
        for (int k = 0; k < held.count; ++k) {
          if (!(bound.active >> k & 1)) continue;
          const SurfaceSample sample = held.collider[k]->query(end, place);
          const double off = (velocity - sample.velocity).dot(sample.normal);
          if (std::fabs(sample.gap) < 1e-6 * position_scale(place))
            place -= sample.gap * sample.normal;
          if (stage.first_order && off >= 0) continue;
          const Vec3 slip = velocity - sample.velocity - off * sample.normal;
          const double most = held.collider[k]->material().braking(slip.norm(), -off);
          change_to(velocity - off * sample.normal - within_cone(slip, most), sample.velocity);
        }
    }
    put_vector(q, i, place);
    put_vector(v, i, velocity);
    work_sums.enter(i, 1, work);
  }
}

// Pushes out what rounding, or rounds that did not converge, left inside; with projected contact
// all penetrations, with restitution.
void ImplicitContact::put_out(double* x_next, bool project) {
  const Contacts& contacts = particles_->contacts();
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  const double end = t_ + h_;
  for (int i = 0; i < layout.n(); ++i) {
    const double mass = particles_->masses()[static_cast<std::size_t>(i)];
    if (!(mass < HUGE_VAL)) continue;
    const Vec3 free = vector_at(q, i);
    if (!contacts.near(end, 0, free, Vec3::Zero(), 0)) continue;
    StepPath path{{free, h_ * vector_at(v, i), Vec3::Zero(), Vec3::Zero()}};
    if (project) {
      path.shift(-path.c[1]);  // so that it ends here
      path.moved = path.held = Vec3::Zero();
      contacts.resolve(t_, h_, path);
    }
    Vec3 place = free + path.moved;
    if (!contacts.push_out(end, place)) contacts.work_sums().refuse(i);
    if (place == free) continue;
    put_vector(q, i, place);
    put_vector(v, i, vector_at(v, i) + path.velocity_change / h_);
    if (project || !held(i)) contacts.work_sums().enter(i, mass / (h_ * h_), path.work);
  }
}

void ImplicitContact::accelerate(const ParticleView& view, double* const a[3]) const {
  if (!begun_ || view.t != t_) return;
  for (const Held& held : held_) {
    const int i = held.particle;
    SupportSurface on[VelocityInequality::kMost];
    std::size_t count = 0;
    const Vec3 velocity = view.velocity(i);
    for (int k = 0; k < held.count; ++k) {
      if (held.since[k] != t_) continue;
      // A separating contact exerts no force.
      const SurfaceSample sample = held.collider[k]->query(t_, view.position(i));
      const double off = (velocity - sample.velocity).dot(sample.normal);
      if (off > kAtRest * (velocity.norm() + sample.velocity.norm())) continue;
      on[count++] = {held.collider[k], sample.normal};
    }
    const Vec3 kept = resting_contact({on, count}, t_, kDifferenceStep * h_, view.position(i),
                                      view.velocity(i), {a[0][i], a[1][i], a[2][i]})
                          .acceleration;
    for (std::size_t axis = 0; axis < 3; ++axis) a[axis][i] = kept[axis];
  }
}

}  // namespace sim
