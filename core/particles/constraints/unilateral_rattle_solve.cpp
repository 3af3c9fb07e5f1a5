// Solves one substep with a known set of contacts.
#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/math/axes.h"
#include "core/particles/constraints/linear_rows.h"
#include "core/particles/constraints/unilateral_rattle.h"
#include "core/particles/late_velocities.h"

namespace sim {
namespace {

constexpr int kMaxContactPasses = 12;        // for contacts that other contact forces cause
constexpr double kSlipTolerance2 = 1e-10;    // of the velocities at hand: a slip that is none
constexpr double kLeastAlongPush = 0.1;      // of a normal, along the direction of its push
constexpr double kOpposing = 0.9;            // cosine of a force that opposes the slip
constexpr double kOfScene = 1e-15;           // of the size of the scene
constexpr double kContactConverged = 1e-13;  // accepted if iterations stall

// The entry of a particle and a collider in a list in the order of particles; its end if none.
template <class Entry>
auto find_of(std::span<Entry> list, int particle, const Collider* collider) {
  auto each = std::ranges::lower_bound(list, particle, {}, &Entry::particle);
  while (each != list.end() && each->particle == particle && each->collider != collider) ++each;
  return each != list.end() && each->particle == particle ? each : list.end();
}

Vec3 surface_velocity(const ContactForce& contact, double t, const Vec3& x) {
  return contact.collider->query(t, x).velocity;
}

}  // namespace

void UnilateralRattle::begin_contact_force(const Impact& impact, bool hit) {
  ContactForce contact;
  contact.particle = impact.particle, contact.collider = impact.collider;
  contact.normal = impact.normal, contact.pressed = impact.pressed;
  contact.active = contact.bilateral = (hit && !impact.known) || impact.pressed > 0;
  if (hit ? impact.bounces : impact.leaves)
    contact.min_velocity =
        impact.collider->material().restitution_at(impact.closing) * impact.closing;
  contacts_.push_back(contact);
}

bool UnilateralRattle::solve_substep(const Substep& substep, double until, bool hit) {
  contacts_.clear();
  until_ = until;
  for (const Impact& impact : impacts_)
    if (impact.known || impact.s <= until) begin_contact_force(impact, hit);
  const double end = substep.t + substep.r, before = energy(end, substep.to);
  work_ = {};
  if (substep.r > 0) {
    std::copy_n(substep.to, free_.size(), free_.data());
    predict_friction(substep);
    if (!solve_positions(substep)) return false;
  }
  if (!solve_end_velocities(substep)) return false;
  work_.lost = before - energy(end, substep.to) + work_.given + late_work_of(substep);
  return true;
}

double UnilateralRattle::late_work_of(const Substep& substep) const {
  if (!first_order_ || substep.r == 0) return 0;
  const ParticleView from = particles_->view(substep.t, substep.from),
                     free = particles_->view(substep.t + substep.r, free_.data()),
                     to = particles_->view(substep.t + substep.r, substep.to);
  double sum = 0;
  for (int i = 0; i < to.n; ++i)
    if (to.free(i))
      sum += to.mass[i] * late_work(substep.r, from.position(i), from.velocity(i), free.position(i),
                                    free.velocity(i), to.velocity(i));
  return sum;
}

// Projects the velocities onto the rows and contacts at the end, with friction. `enough`: relative
// to the largest speed, the residual that is accepted if iterations stall.
bool UnilateralRattle::solve_velocities(const Substep& substep, double enough) {
  const auto v = particles_->layout().axes(substep.to, 3);
  const double speed = max_speed(substep);
  struct Velocities final : LinearRows {
    using LinearRows::LinearRows;
    double gap(ContactForce& contact, const Vec3& y) override {
      return contact.normal.dot(y - contact.surface_velocity) - contact.min_velocity;
    }
  } problem(rows_, v, rows_.drive());
  problem.row_tolerance = problem.gap_tolerance = kOfScene * speed;
  problem.enough = enough * speed;
  problem.slow = kSlipTolerance2 * speed;
  return solver_.solve(velocity_contacts_, rows_.gradient(), v, problem);
}

double UnilateralRattle::max_speed(const Substep& substep) const {
  double speed = 1e-30;
  const ParticleView view = particles_->view(substep.t + substep.r, substep.to);
  for (int i = 0; i < view.n; ++i) speed = std::max(speed, view.velocity(i).norm());
  for (const ContactForce& contact : velocity_contacts_)
    speed = std::max(speed, contact.surface_velocity.norm());
  return speed;
}

// The friction coefficient at the slip speed at the start of the substep.
double UnilateralRattle::friction_of(const ContactForce& contact, const Substep& substep) const {
  const ContactMaterial surface = contact.collider->material();
  if (!surface.law) return surface.friction;
  const ParticleView from = particles_->view(substep.t, substep.from);
  const SurfaceSample sample = contact.collider->query(substep.t, from.position(contact.particle));
  const Vec3 slip = from.velocity(contact.particle) - sample.velocity;
  return surface.friction_at(tangential(slip, sample.normal).norm());
}

// Predicts the friction of the substep from the velocities at its end, as if all impulses acted
// there. Half of it is applied tangentially to the surfaces at the start.
void UnilateralRattle::predict_friction(const Substep& substep) {
  const Layout& layout = particles_->layout();
  const double end = substep.t + substep.r;
  const ParticleView from = particles_->view(substep.t, substep.from),
                     to = particles_->view(end, substep.to);
  const auto slip_at_start = [&](const ContactForce& contact) {
    const Vec3 u = contact.collider->query(substep.t, from.position(contact.particle)).velocity;
    return tangential(from.velocity(contact.particle) - u, contact.normal);
  };
  velocity_contacts_.clear();
  for (const ContactForce& each : contacts_) {
    ContactForce contact = each;
    if (contact.bilateral && contact.pressed == 0) continue;  // it hits
    const SurfaceSample sample = contact.collider->query(end, to.position(contact.particle));
    contact.friction = friction_of(contact, substep);
    contact.surface_velocity = sample.velocity, contact.normal = sample.normal;
    contact.extra_friction = contact.friction * contact.pressed;
    contact.active = contact.bilateral = contact.pressed > 0;
    velocity_contacts_.push_back(contact);
  }
  if (std::ranges::none_of(velocity_contacts_,
                           [](const ContactForce& contact) { return contact.friction > 0; }))
    return;
  if (!rows_.evaluate(to, substep.to + constraint_system_->internal_begin())) return;
  const bool found = solve_velocities(substep, 1e-9);
  for (int axis = 3; axis < 6; ++axis)
    std::copy_n(layout.block(free_.data(), axis), layout.n(), layout.block(substep.to, axis));
  if (!found) return;
  auto next = velocity_contacts_.cbegin();
  for (ContactForce& contact : contacts_) {
    if (next == velocity_contacts_.cend()) break;
    if (next->particle != contact.particle || next->collider != contact.collider) continue;
    if (next->active) {
      // Friction that opposes the slip at the start is applied exactly against it.
      const Vec3 slip = slip_at_start(contact);
      const double size = slip.norm(), pull = next->friction_force.norm();
      contact.friction_impulse = 0.5 * tangential(next->friction_force, contact.normal);
      if (next->friction_force.dot(slip) < -kOpposing * size * pull)
        contact.friction_impulse = -0.5 * std::min(pull, next->max_friction()) / size * slip;
    }
    ++next;
  }
}

// Adds particles that contact forces have put into a surface. Before it is known where the substep
// is cut, impacts of their own are left out; at the cut, those that would have come later come now.
bool UnilateralRattle::add_penetrating(const Substep& substep) {
  const double end = substep.t + substep.r;
  const std::size_t before = contacts_.size();
  find_candidates({end, 0, substep.to, substep.to});
  for (const int i : candidates_) {
    const Vec3 place = particles_->view(end, substep.to).position(i);
    for (Collider* const collider : particles_->contacts().all()) {
      const SurfaceSample sample = collider->query(end, place);
      if (!(sample.gap < -Contacts::slack(place))) continue;
      const auto known = std::span(contacts_).first(before);
      if (find_of(known, i, collider) != known.end()) continue;
      const auto own = find_of(std::span(impacts_), i, collider);
      const bool hits = own != std::span(impacts_).end() && !own->known && own->s > until_;
      if (hits && until_ < 0) continue;
      Impact impact;
      impact.particle = i, impact.collider = collider, impact.normal = sample.normal;
      begin_contact_force(hits ? *own : impact, hits);
    }
  }
  // Inserts the new contacts in the order of particles; a stable sort would allocate.
  for (auto next = contacts_.begin() + static_cast<std::ptrdiff_t>(before); next != contacts_.end();
       ++next) {
    const auto place = std::ranges::upper_bound(contacts_.begin(), next, next->particle, {},
                                                &ContactForce::particle);
    std::rotate(place, next, next + 1);
  }
  return contacts_.size() > before;
}

// Projects the positions of the substep without contact, to which friction is added.
bool UnilateralRattle::project_contacts(const Substep& substep, bool nearest) {
  const Layout& layout = particles_->layout();
  const std::size_t memory = constraint_system_->internal_begin();
  const double end = substep.t + substep.r;
  const auto q = layout.axes(substep.to);
  for (int axis = 0; axis < 3; ++axis)
    std::copy_n(layout.block(free_.data(), axis), layout.n(), layout.block(substep.to, axis));
  double size = constraint_system_->constraints().size();
  for (ContactForce& contact : contacts_) {
    const auto i = static_cast<std::size_t>(contact.particle);
    const Vec3 x = vector_at(q, contact.particle);
    size = std::max(size, position_scale(x));
    put_vector(
        q, contact.particle,
        x + substep.r * constraint_system_->constraints().weights()[i] * contact.friction_impulse);
    contact.active = contact.bilateral;
  }
  struct Places final : ActiveSetContactSolver::Problem {
    RowValues& values;
    const ParticleView now;
    const double* memory;
    Places(RowValues& of, const ParticleView& at, const double* with)
        : values(of), now(at), memory(with) {}
    bool rows(std::span<double> rest) override {
      if (!values.evaluate(now, memory)) return false;
      std::ranges::copy(values.phi(), rest.begin());
      return true;
    }
    double gap(ContactForce& contact, const Vec3& y) override {
      const SurfaceSample sample = contact.collider->query(now.t, y);
      if (nearest) contact.normal = sample.normal;
      return sample.gap / std::max(kLeastAlongPush, contact.normal.dot(sample.normal));
    }
  } problem(rows_, particles_->view(end, substep.to), substep.to + memory);
  problem.row_tolerance = kOfScene * size;
  problem.gap_tolerance = 0.1 * Contacts::slack(Vec3(size, 0, 0));
  problem.enough = kContactConverged * size;
  problem.nearest = nearest;
  const std::span<const Vec3> gradient = nearest ? rows_.gradient() : start_rows_.gradient();
  bool found = solver_.solve(contacts_, gradient, q, problem);
  for (int turn = 0; turn < kMaxContactPasses && found && add_penetrating(substep); ++turn)
    found = solver_.go_on(contacts_, gradient, q, problem);
  return found;
}

// Names the constraint row with the largest residual, or a particle.
bool UnilateralRattle::refuse(const std::string& unit) {
  const ActiveSetContactSolver::Worst& worst = solver_.worst();
  const RowList& list = constraint_system_->constraints().rows();
  std::string who =
      "particle " + std::to_string(contacts_.empty() ? 0 : contacts_.front().particle);
  if (worst.row_id >= 0)
    who = "constraint '" + constraint_system_->constraints().title(list.part_of(worst.row_id)) +
          "', " + list.name(worst.row_id);
  constraint_system_->refuse(who + ": constraints and colliders leave no room, off by " +
                             brief(std::max(worst.row, -worst.gap), 3) + unit);
  return false;
}

bool UnilateralRattle::solve_positions(const Substep& substep) {
  const Layout& layout = particles_->layout();
  const std::size_t memory = constraint_system_->internal_begin();
  const ParticleView begin = particles_->view(substep.t, substep.from);
  if (!start_rows_.evaluate(begin, substep.from + memory)) return false;
  // The last substep falls back to the nearest feasible positions, as for rods that pass through a
  // straight line, where rows change too much.
  if (!project_contacts(substep, false) && (!substep.last || !project_contacts(substep, true))) {
    return refuse(" m");
  }
  // Velocities get the first half of the constraint and contact impulses.
  const auto v = layout.axes(substep.to, 3);
  const std::span<const double> weights = constraint_system_->constraints().weights();
  for (int i = 0; i < layout.n(); ++i)
    if (weights[static_cast<std::size_t>(i)] > 0)
      put_vector(v, i, vector_at(v, i) + solver_.added(i) / substep.r);
  for (const ContactForce& contact : contacts_) {
    const int i = contact.particle;
    put_vector(v, i,
               vector_at(v, i) + weights[static_cast<std::size_t>(i)] * contact.friction_impulse);
    work_.given += (contact.force / substep.r * contact.normal + contact.friction_impulse)
                       .dot(surface_velocity(contact, substep.t, begin.position(i)));
  }
  work_.given += start_rows_.driving_power(solver_.multipliers(), begin) / substep.r;
  constraint_system_->constraints().follow(particles_->view(substep.t + substep.r, substep.to),
                                           substep.to + memory);
  return true;
}

bool UnilateralRattle::solve_end_velocities(const Substep& substep) {
  const Layout& layout = particles_->layout();
  const double end = substep.t + substep.r;
  const auto q = layout.axes(substep.to);
  if (!rows_.evaluate(particles_->view(end, substep.to),
                      substep.to + constraint_system_->internal_begin()))
    return false;
  velocity_contacts_.clear();
  for (ContactForce contact : contacts_) {
    const Vec3 x = vector_at(q, contact.particle);
    const SurfaceSample sample = contact.collider->query(end, x);
    if (!contact.bilateral && sample.gap > kContactTolerance * position_scale(x)) continue;
    contact.friction = friction_of(contact, substep);
    contact.normal = sample.normal, contact.surface_velocity = sample.velocity;
    // The friction of both halves together obeys Coulomb's law.
    if (substep.r > 0 && contact.friction > 0)
      contact.extra_friction = contact.friction * std::max(0.0, contact.force) / substep.r +
                               contact.friction * contact.pressed - contact.friction_impulse.norm();
    contact.active = contact.bilateral = contact.pressed > 0;
    velocity_contacts_.push_back(contact);
  }
  if (!solve_velocities(substep, 1e-12)) {
    if (!substep.last) return false;
    for (ContactForce& contact : velocity_contacts_) contact.friction = contact.extra_friction = 0;
    if (!solve_velocities(substep, 1e-6)) return refuse(" m/s");
  }
  for (const ContactForce& contact : velocity_contacts_)
    if (contact.active)
      work_.given +=
          (contact.force * contact.normal + contact.friction_force).dot(contact.surface_velocity);
  work_.given += rows_.driving_power(solver_.multipliers(), particles_->view(end, substep.to));
  return true;
}

}  // namespace sim
