#include "contact_solver.h"

#include <algorithm>
#include <cmath>

#include "body_joints.h"
#include "core/base/slot.h"
#include "core/particles/collider.h"
#include "rotation.h"

namespace sim {
namespace {

constexpr std::size_t kMostBounces = 400;       // of each point
constexpr std::size_t kMostLooked = 2'000'000;  // points that are looked at for the next bounce
constexpr double kHeld = 1e-9;                  // of the softness alone: links do not let it move
// An approach slower than this share of the fastest is none. Points without restitution would give
// each other a geometric series of ever weaker impulses; resting contact solves its rest.
constexpr double kNoApproach = 1e-13, kInelastic = 1e-3;

// The change of the velocity along n, at an arm, by a unit impulse along n there.
double inverse_effective_mass(const SolverBody& solver_body, const Vec3& arm, const Vec3& n) {
  const Vec3 moment = arm.cross(n);
  return solver_body.inverse_mass + moment.dot(solver_body.inverse_inertia * moment);
}

}  // namespace

double ContactPoint::restitution_at(double approach) const {
  if (!has_law()) return restitution;
  approach = std::max(0.0, approach);
  return std::max(sides[0].restitution_at(approach), sides[1].restitution_at(approach));
}

double ContactPoint::friction_at(double slip) const {
  if (!has_law()) return friction;
  return std::sqrt(sides[0].friction_at(slip) * sides[1].friction_at(slip));
}

void ContactSolver::apply(std::span<SolverBody> solver_bodies, const ContactPoint& contact,
                          const Vec3& p, double duration) {
  const auto push = [&](SolverBody& solver_body, const Vec3& arm, const Vec3& impulse) {
    const Vec3 dv = solver_body.inverse_mass * impulse;
    const Vec3 dw = solver_body.inverse_inertia * arm.cross(impulse);
    solver_body.velocity += dv;
    solver_body.angular_velocity += dw;
    solver_body.translation += duration * dv;
    solver_body.rotation += duration * dw;
  };
  push(solver_bodies[static_cast<std::size_t>(contact.first)], contact.arm1, p);
  if (contact.second >= 0)
    push(solver_bodies[static_cast<std::size_t>(contact.second)], contact.arm2, -p);
}

Vec3 ContactSolver::velocity(std::span<const SolverBody> solver_bodies,
                             const ContactPoint& contact) {
  const auto of = [&](int i, const Vec3& arm) {
    const SolverBody& solver_body = solver_bodies[static_cast<std::size_t>(i)];
    return solver_body.velocity + solver_body.angular_velocity.cross(arm);
  };
  return of(contact.first, contact.arm1) -
         (contact.second >= 0 ? of(contact.second, contact.arm2) : contact.ground);
}

void ContactSolver::prepare(std::span<ContactPoint> contacts, ThreadPool& pool) {
  constexpr int kWorthThreads = 1024;  // points
  pool.run_if_many(static_cast<int>(contacts.size()), kWorthThreads, [&](int begin, int end) {
    for (ContactPoint& m : contacts.subspan(slot(begin), slot(end - begin))) {
      const Vec3& n = m.normal;
      const Vec3 side = n.cross(std::fabs(n.x()) < 0.8 ? Vec3(1, 0, 0) : Vec3(0, 0, 1));
      m.u = side / side.norm();
      m.v = n.cross(m.u);
      m.tangent_impulse[0] = m.u.dot(m.friction_impulse);
      m.tangent_impulse[1] = m.v.dot(m.friction_impulse);
    }
  });
}

// The changes of velocity by unit impulses: along the normal, and along the surface the larger
// eigenvalue of the 2 x 2 matrix.
void ContactSolver::find_inverse_masses(std::span<const SolverBody> solver_bodies,
                                        ContactPoint& m) {
  const auto soft = [&](const Vec3& along) {
    double sum =
        inverse_effective_mass(solver_bodies[static_cast<std::size_t>(m.first)], m.arm1, along);
    if (m.second >= 0)
      sum +=
          inverse_effective_mass(solver_bodies[static_cast<std::size_t>(m.second)], m.arm2, along);
    return sum;
  };
  m.inverse_mass_n = soft(m.normal);
  const double diagonal = soft((m.u + m.v) / std::sqrt(2.0)), u = soft(m.u), v = soft(m.v);
  const double mixed = diagonal - 0.5 * (u + v);
  m.inverse_mass_t = 0.5 * (u + v) + std::sqrt(0.25 * (u - v) * (u - v) + mixed * mixed);
}

// The groups of joints of both sides, -1: none.
std::array<int, 2> ContactSolver::groups_of(const ContactPoint& m) const {
  const auto of = [&](int body) { return joints_ && body >= 0 ? joints_->group_of(body) : -1; };
  const int first = of(m.first), second = of(m.second);
  return {first, second == first ? -1 : second};
}

// The change of the normal velocity by a unit normal impulse, with all joints.
double ContactSolver::joint_inverse_mass(std::span<const SolverBody> solver_bodies,
                                         const ContactPoint& m) {
  const std::array<int, 2> groups = groups_of(m);
  if (groups[0] < 0 && groups[1] < 0) return m.inverse_mass_n;
  const auto reset = [&](int body) {
    if (body < 0) return;
    SolverBody& each = scratch_[static_cast<std::size_t>(body)];
    each = solver_bodies[static_cast<std::size_t>(body)];
    each.velocity = each.angular_velocity = {};
  };
  reset(m.first), reset(m.second);
  for (const int group : groups)
    if (group >= 0)
      for (const int body : joints_->bodies_of(static_cast<std::size_t>(group))) reset(body);
  apply(scratch_, m, m.normal, 0);
  for (const int group : groups)
    if (group >= 0)
      joints_->project(scratch_, static_cast<std::size_t>(group), JointGroup::What::kChanges);
  Vec3 w = velocity(scratch_, m);
  if (m.second < 0) w += m.ground;
  return m.normal.dot(w);
}

void ContactSolver::set_arms(std::span<const SolverBody> solver_bodies, ContactPoint& m,
                             double time) {
  if (m.rounding >= 0) {
    const SolverBody& body = solver_bodies[static_cast<std::size_t>(m.first)];
    const Vec3 rounding = m.rounding * m.normal;
    m.arm1 =
        turned_over(m.arm1 + rounding, body.rotation - time * body.angular_velocity) - rounding;
  }
  if (m.second < 0) return;
  const auto center = [&](int i) {
    const SolverBody& body = solver_bodies[static_cast<std::size_t>(i)];
    return body.center + body.translation - time * body.velocity;
  };
  const Vec3 apart = (m.arm1 + center(m.first)) - (m.arm2 + center(m.second));
  m.arm1 -= 0.5 * apart, m.arm2 += 0.5 * apart;
}

double ContactSolver::moved(std::span<const SolverBody> solver_bodies,
                            const ContactPoint& contact) {
  const auto of = [&](int i, const Vec3& arm) {
    const SolverBody& solver_body = solver_bodies[static_cast<std::size_t>(i)];
    return solver_body.translation + solver_body.rotation.cross(arm);
  };
  Vec3 displacement = of(contact.first, contact.arm1);
  if (contact.second >= 0) displacement -= of(contact.second, contact.arm2);
  return contact.normal.dot(displacement);
}

Approach ContactSolver::approach_of(std::span<const SolverBody> solver_bodies,
                                    const ContactPoint& m) {
  return {.gap = m.path_gap + moved(solver_bodies, m),
          .rate = m.normal.dot(velocity(solver_bodies, m)) - m.path_gain,
          .acceleration = m.acceleration,
          .tiny = m.tiny,
          .least = 0,
          .shortest = HUGE_VAL};
}

void ContactSolver::update_approach(std::span<const SolverBody> solver_bodies,
                                    std::span<const ContactPoint> contacts, std::size_t k,
                                    double now) {
  const Approach seen = approach_of(solver_bodies, contacts[k]);
  approaches_[k].gap = seen.gap, approaches_[k].rate = seen.rate;
  touches_[k] = approaches_[k].next_touch(now);
}

// Sorts the contacts by body, by counting.
void ContactSolver::list_contacts(std::size_t bodies, std::span<const ContactPoint> contacts) {
  first_.assign(bodies + 2, 0);
  const auto each = [&](const auto& visit) {
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      visit(k, static_cast<std::size_t>(contacts[k].first));
      if (contacts[k].second >= 0) visit(k, static_cast<std::size_t>(contacts[k].second));
    }
  };
  each([&](std::size_t, std::size_t body) { ++first_[body + 2]; });
  for (std::size_t i = 2; i < first_.size(); ++i) first_[i] += first_[i - 1];
  contacts_of_.resize(first_.back());
  each([&](std::size_t k, std::size_t body) { contacts_of_[first_[body + 1]++] = k; });
}

void ContactSolver::solve_restitution(std::span<SolverBody> solver_bodies,
                                      std::span<ContactPoint> contacts, double h, double shortest,
                                      ThreadPool& pool) {
  double fastest = 0, now = h;
  for (const ContactPoint& m : contacts)
    if (m.active) fastest = std::max(fastest, -m.before);
  list_contacts(solver_bodies.size(), contacts);
  if (joints_) scratch_.resize(solver_bodies.size());
  approaches_.resize(contacts.size());
  touches_.resize(contacts.size());
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    ContactPoint& m = contacts[k];
    find_inverse_masses(solver_bodies, m);
    const bool rebounds = m.restitution > 0 || m.has_law();
    approaches_[k] = {.acceleration = m.acceleration,
                      .tiny = m.tiny,
                      .least = (rebounds ? kNoApproach : kInelastic) * fastest,
                      .shortest = rebounds ? shortest : HUGE_VAL};
    update_approach(solver_bodies, contacts, k, now);
  }
  std::size_t after = 0;  // the meeting behind the last one: who comes next at the same moment
  const std::size_t most = std::min(kMostBounces * contacts.size(),
                                    kMostLooked / std::max<std::size_t>(1, contacts.size()));
  for (std::size_t left = most; left > 0 && !pool.gives_up(0); --left) {
    std::size_t next = contacts.size();
    double earliest = -1, soft = 0;
    const auto look = [&](std::size_t from, std::size_t to) {
      for (std::size_t k = from; k < to; ++k) {
        if (!(touches_[k] > earliest)) continue;
        const ContactPoint& m = contacts[k];
        const double own = joints_ ? joint_inverse_mass(solver_bodies, m) : m.inverse_mass_n;
        if (!(own > kHeld * m.inverse_mass_n)) continue;
        next = k, earliest = touches_[k], soft = own;
      }
    };
    look(after, contacts.size());
    look(0, after);
    if (next == contacts.size()) return;
    ContactPoint& meets = contacts[next];
    now = earliest;
    after = next + 1;
    if (!meets.active) meets.duration = now;
    meets.active = true, meets.after = now;
    meets.given = meets.path_gain + meets.acceleration * now;
    ContactPoint m = meets;
    set_arms(solver_bodies, m, now);
    if (!joints_) find_inverse_masses(solver_bodies, m), soft = m.inverse_mass_n;
    const Vec3 slip = velocity(solver_bodies, m);
    const double rate = m.normal.dot(slip) - m.given;
    const double push = -(1 + m.restitution_at(-rate)) * rate / soft;
    // The slip at the impact: forces may add to it until the end of the step.
    const Vec3 along = tangential(slip, m.normal) - m.path_slip_gain - now * m.slip_acceleration;
    const Vec3 pull = within_cone(-along / m.inverse_mass_t, m.friction_at(along.norm()) * push);
    apply(solver_bodies, m, push * m.normal + pull, now);
    const auto update = [&](int body) {
      if (body < 0) return;
      const auto b = static_cast<std::size_t>(body);
      for (std::size_t k = first_[b]; k < first_[b + 1]; ++k)
        update_approach(solver_bodies, contacts, contacts_of_[k], now);
    };
    for (const int group : groups_of(m))
      if (group >= 0) {
        for (const auto what : {JointGroup::What::kVelocities, JointGroup::What::kDisplacements})
          joints_->project(solver_bodies, static_cast<std::size_t>(group), what);
        for (const int body : joints_->bodies_of(static_cast<std::size_t>(group))) update(body);
      }
    update(m.first), update(m.second);
  }
}

void ContactSolver::start(std::span<SolverBody> solver_bodies,
                          std::span<const ContactPoint> contacts) {
  touched_.assign(joints_ ? joints_->groups() : 0, 0);
  for (const ContactPoint& m : contacts) {
    if (!m.active || !(m.normal_impulse > 0)) continue;
    apply(solver_bodies, m,
          m.normal_impulse * m.normal + m.tangent_impulse[0] * m.u + m.tangent_impulse[1] * m.v,
          m.duration);
    for (const int group : groups_of(m))
      if (group >= 0) touched_[slot(group)] = 1;
  }
  for (std::size_t group = 0; group < touched_.size(); ++group)
    if (touched_[group]) joints_->project(solver_bodies, group, JointGroup::What::kVelocities);
}

}  // namespace sim
