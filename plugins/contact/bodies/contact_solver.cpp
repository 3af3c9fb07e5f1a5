#include "contact_solver.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr int kMostBounces = 400, kFewSweeps = 3, kMostTurns = 12, kMostSweeps = 200;
constexpr double kHeld = 1e-9;  // of the softness alone: links do not let it move

// How much an impulse along n at an arm changes the velocity there along n.
double inverse_effective_mass(const SolverBody& solver_body, const Vec3& arm, const Vec3& n) {
  const Vec3 moment = arm.cross(n);
  return solver_body.inverse_mass + moment.dot(solver_body.inverse_inertia * moment);
}

// Coulomb's cone, of a pull in two directions along the surface.
void limit(double most, double& pu, double& pv) {
  const double size = std::sqrt(pu * pu + pv * pv);
  if (size > most) pu *= most / size, pv *= most / size;
}

// The impulses of a meeting become these: the movers feel the difference.
void change(std::span<SolverBody> solver_bodies, ContactPoint& m, double push, double pu,
            double pv) {
  ContactSolver::apply(solver_bodies, m,
                       (push - m.normal_impulse) * m.normal + (pu - m.tangent_impulse[0]) * m.u +
                           (pv - m.tangent_impulse[1]) * m.v,
                       m.duration);
  m.normal_impulse = push, m.tangent_impulse[0] = pu, m.tangent_impulse[1] = pv;
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

void ContactSolver::prepare(std::span<SolverBody> solver_bodies,
                            std::span<ContactPoint> contacts) const {
  for (ContactPoint& m : contacts) {
    const Vec3& n = m.normal;
    const Vec3 side = n.cross(std::fabs(n.x()) < 0.8 ? Vec3(1, 0, 0) : Vec3(0, 0, 1));
    m.u = side / side.norm();
    m.v = n.cross(m.u);
    const auto soft = [&](const Vec3& along) {
      double sum =
          inverse_effective_mass(solver_bodies[static_cast<std::size_t>(m.first)], m.arm1, along);
      if (m.second >= 0)
        sum += inverse_effective_mass(solver_bodies[static_cast<std::size_t>(m.second)], m.arm2,
                                      along);
      return sum;
    };
    m.tangent_impulse[0] = m.u.dot(m.friction_impulse),
    m.tangent_impulse[1] = m.v.dot(m.friction_impulse);
    m.inverse_mass_n = soft(n);
    // Along the surface the larger value of a matrix of 2 x 2.
    const double diagonal = soft((m.u + m.v) / std::sqrt(2.0)), u = soft(m.u), v = soft(m.v);
    const double mixed = diagonal - 0.5 * (u + v);
    m.inverse_mass_t = 0.5 * (u + v) + std::sqrt(0.25 * (u - v) * (u - v) + mixed * mixed);
  }
}

// How much an impulse along the normal changes the velocity there, with all that is linked.
double ContactSolver::joint_inverse_mass(std::span<const SolverBody> solver_bodies,
                                         const ContactPoint& m) {
  scratch_.assign(solver_bodies.begin(), solver_bodies.end());
  for (SolverBody& each : scratch_) each.velocity = each.angular_velocity = {};
  apply(scratch_, m, m.normal, 0);
  joints_->project(scratch_, true);
  Vec3 w = velocity(scratch_, m);
  if (m.second < 0) w += m.ground;
  return m.normal.dot(w);
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

double time_since(double gap, double rate, double a, double h) {
  const double square = rate * rate - 2 * a * gap;
  const double q = 0.5 * (rate + std::copysign(std::sqrt(std::max(0.0, square)), rate));
  double best = h;
  for (const double s : {q != 0 ? gap / q : h, a != 0 ? 2 * q / a : h})
    if (s >= 0 && s < best) best = s;
  return best;
}

// The gap s before the end is g - v s + a s^2 / 2, with g and v those at the end.
double ContactSolver::next_touch(std::span<const SolverBody> solver_bodies, const ContactPoint& m,
                                 double now, double fastest) {
  const double g = m.path_gap + moved(solver_bodies, m), a = m.acceleration,
               v = m.normal.dot(velocity(solver_bodies, m)) - m.path_gain;
  double s = now;
  if (g - (v - 0.5 * a * now) * now > m.tiny) {
    if (!(g < 0)) return -1;
    s = time_since(g, v, a, now);
  } else if (g > m.tiny) {
    return -1;
  }
  return v - a * s < -1e-13 * fastest ? s : -1;
}

void ContactSolver::solve_restitution(std::span<SolverBody> solver_bodies,
                                      std::span<ContactPoint> contacts, double h) {
  double fastest = 0, now = h;
  for (const ContactPoint& m : contacts)
    if (m.active) fastest = std::max(fastest, -m.before);
  std::size_t after = 0;  // the meeting behind the last one: who comes next at the same moment
  for (std::size_t left = kMostBounces * contacts.size(); left > 0; --left) {
    std::size_t next = contacts.size();
    double earliest = -1, soft = 0;
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const std::size_t at = (after + k) % contacts.size();
      const ContactPoint& m = contacts[at];
      const double s = next_touch(solver_bodies, m, now, fastest);
      if (!(s > earliest)) continue;
      const double own = joints_ ? joint_inverse_mass(solver_bodies, m) : m.inverse_mass_n;
      if (!(own > kHeld * m.inverse_mass_n)) continue;
      next = at, earliest = s, soft = own;
    }
    if (next == contacts.size()) return;
    ContactPoint& m = contacts[next];
    now = earliest;
    after = next + 1;
    if (!m.active) m.duration = now;
    m.active = true, m.after = now, m.given = m.path_gain + m.acceleration * now;
    const Vec3 slip = velocity(solver_bodies, m);
    const double rate = m.normal.dot(slip) - m.given;
    const double push = -(1 + m.restitution_at(-rate)) * rate / soft;
    const Vec3 along = slip - m.normal.dot(slip) * m.normal;
    const Vec3 pull = within_cone(-along / m.inverse_mass_t, m.friction_at(along.norm()) * push);
    apply(solver_bodies, m, push * m.normal + pull, now);
    if (joints_) joints_->project(solver_bodies, false);
  }
}

void ContactSolver::start(std::span<SolverBody> solver_bodies,
                          std::span<const ContactPoint> contacts) const {
  for (const ContactPoint& m : contacts)
    if (m.active && m.normal_impulse > 0)
      apply(solver_bodies, m,
            m.normal_impulse * m.normal + m.tangent_impulse[0] * m.u + m.tangent_impulse[1] * m.v,
            m.duration);
  if (joints_) joints_->project(solver_bodies, false);
}

// There and back.
double ContactSolver::sweep(std::span<SolverBody> solver_bodies,
                            std::span<ContactPoint> contacts) const {
  double change = 0;
  const auto solve = [&](ContactPoint& m) {
    if (!m.active) return;
    const Vec3 w = velocity(solver_bodies, m);
    const double push =
        std::max(0.0, m.normal_impulse - (m.normal.dot(w) + m.offset) / m.inverse_mass_n);
    const double added = push - m.normal_impulse;
    m.normal_impulse = push;
    if (added != 0) apply(solver_bodies, m, added * m.normal, m.duration);
    change = std::max(change, std::fabs(added) * m.inverse_mass_n);
    if (!(m.friction > 0)) return;
    const Vec3 slip = velocity(solver_bodies, m);
    double pu = m.tangent_impulse[0] - m.u.dot(slip) / m.inverse_mass_t,
           pv = m.tangent_impulse[1] - m.v.dot(slip) / m.inverse_mass_t;
    limit(m.friction * push, pu, pv);
    const double du = pu - m.tangent_impulse[0], dv = pv - m.tangent_impulse[1];
    m.tangent_impulse[0] = pu, m.tangent_impulse[1] = pv;
    if (du != 0 || dv != 0) apply(solver_bodies, m, du * m.u + dv * m.v, m.duration);
    change = std::max(change, (std::fabs(du) + std::fabs(dv)) * m.inverse_mass_t);
  };
  for (ContactPoint& m : contacts) solve(m);
  for (std::size_t k = contacts.size(); k-- > 0;) solve(contacts[k]);
  if (joints_ && change > 0) joints_->project(solver_bodies, false);
  return change;
}

// Active contacts stay active and sticking ones stick: linear equations, singular where more points
// hold a body than are needed, but consistent.
void ContactSolver::solve_sticking(std::span<SolverBody> solver_bodies,
                                   std::span<ContactPoint> contacts, double tolerance) {
  const std::size_t count = contacts.size();
  search_.resize(count);
  scratch_.resize(solver_bodies.size());
  const auto parts = [&](const ContactPoint& m, const Search& s, const Vec3& w) {
    return Vec3(s.normal_impulse ? m.normal.dot(w) : 0, s.friction_impulse ? m.u.dot(w) : 0,
                s.friction_impulse ? m.v.dot(w) : 0);
  };
  const auto scaled = [](const ContactPoint& m, const Vec3& r) {
    return Vec3(r[0] / m.inverse_mass_n, r[1] / m.inverse_mass_t, r[2] / m.inverse_mass_t);
  };
  double energy = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const ContactPoint& m = contacts[k];
    Search& s = search_[k] = {};
    s.before = {m.normal_impulse, m.tangent_impulse[0], m.tangent_impulse[1]};
    s.normal_impulse = m.active && m.normal_impulse > 0;
    const double pull = std::sqrt(m.tangent_impulse[0] * m.tangent_impulse[0] +
                                  m.tangent_impulse[1] * m.tangent_impulse[1]);
    s.friction_impulse = s.normal_impulse && pull < (1 - 1e-9) * m.friction * m.normal_impulse;
    if (!s.normal_impulse) continue;
    s.rest = -parts(m, s, velocity(solver_bodies, m) + m.offset * m.normal);
    s.direction = scaled(m, s.rest);
    energy += s.rest.dot(s.direction);
  }
  for (std::size_t turn = 0; turn < 6 * solver_bodies.size() + 20 && energy > 0; ++turn) {
    for (std::size_t i = 0; i < solver_bodies.size(); ++i) {
      scratch_[i] = solver_bodies[i];
      scratch_[i].velocity = scratch_[i].angular_velocity = {};
    }
    for (std::size_t k = 0; k < count; ++k)
      if (const ContactPoint& m = contacts[k]; search_[k].normal_impulse) {
        const Vec3& d = search_[k].direction;
        apply(scratch_, m, d[0] * m.normal + d[1] * m.u + d[2] * m.v, 0);
      }
    if (joints_) joints_->project(scratch_, true);
    double bend = 0, largest = 0, next = 0;
    for (std::size_t k = 0; k < count; ++k) {
      Search& s = search_[k];
      if (!s.normal_impulse) continue;
      Vec3 w = velocity(scratch_, contacts[k]);
      if (contacts[k].second < 0) w += contacts[k].ground;
      s.image = parts(contacts[k], s, w);
      bend += s.image.dot(s.direction);
    }
    if (!(bend > 0)) break;
    for (std::size_t k = 0; k < count; ++k) {
      Search& s = search_[k];
      if (!s.normal_impulse) continue;
      s.found += energy / bend * s.direction;
      s.rest -= energy / bend * s.image;
      largest = std::max(largest, s.rest.cwiseAbs().maxCoeff());
      next += s.rest.dot(scaled(contacts[k], s.rest));
    }
    if (largest <= 0.1 * tolerance) break;
    for (std::size_t k = 0; k < count; ++k)
      search_[k].direction =
          scaled(contacts[k], search_[k].rest) + next / energy * search_[k].direction;
    energy = next;
  }
  for (std::size_t k = 0; k < count; ++k) {
    ContactPoint& m = contacts[k];
    const Search& s = search_[k];
    if (!s.normal_impulse) continue;
    const double push = std::max(0.0, m.normal_impulse + s.found[0]);
    double pu = m.tangent_impulse[0] + s.found[1], pv = m.tangent_impulse[1] + s.found[2];
    limit(m.friction * push, pu, pv);
    change(solver_bodies, m, push, pu, pv);
  }
  if (joints_) joints_->project(solver_bodies, false);
}

double ContactSolver::solve_resting(std::span<SolverBody> solver_bodies,
                                    std::span<ContactPoint> contacts, double tolerance) {
  double change = 0;
  for (int round = 0; round < kMostTurns; ++round) {
    for (int k = 0; k < kFewSweeps * (1 + round); ++k)
      if (change = sweep(solver_bodies, contacts); change <= tolerance) return change;
    solve_sticking(solver_bodies, contacts, tolerance);
    const double found = sweep(solver_bodies, contacts);
    if (found <= tolerance) return found;
    if (found > change) restore_impulses(solver_bodies, contacts);
  }
  for (int k = 0; k < kMostSweeps && change > tolerance; ++k)
    change = sweep(solver_bodies, contacts);
  return change;
}

// The impulses before stick(), which did no good.
void ContactSolver::restore_impulses(std::span<SolverBody> solver_bodies,
                                     std::span<ContactPoint> contacts) const {
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const Vec3& old = search_[k].before;
    if (contacts[k].active) change(solver_bodies, contacts[k], old[0], old[1], old[2]);
  }
  if (joints_) joints_->project(solver_bodies, false);
}

}  // namespace sim
