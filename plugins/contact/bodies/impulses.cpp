#include "impulses.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr int kMostBounces = 400, kFewSweeps = 3, kMostTurns = 12, kMostSweeps = 200;
constexpr double kHeld = 1e-9;  // of the softness alone: links do not let it move

// How much an impulse along n at an arm changes the velocity there along n.
double softness(const Mover& mover, const Vec3& arm, const Vec3& n) {
  const Vec3 moment = arm.cross(n);
  return mover.inverse_mass + moment.dot(mover.inverse_inertia * moment);
}

// Coulomb's cone, of a pull in two directions along the surface.
void limit(double most, double& pu, double& pv) {
  const double size = std::sqrt(pu * pu + pv * pv);
  if (size > most) pu *= most / size, pv *= most / size;
}

// The impulses of a meeting become these: the movers feel the difference.
void change(std::span<Mover> movers, Meet& m, double push, double pu, double pv) {
  Impulses::apply(movers, m,
                  (push - m.push) * m.normal + (pu - m.pull_u) * m.u + (pv - m.pull_v) * m.v,
                  m.lever);
  m.push = push, m.pull_u = pu, m.pull_v = pv;
}

}  // namespace

double Meet::restitution_at(double approach) const {
  if (!has_law()) return restitution;
  approach = std::max(0.0, approach);
  return std::max(sides[0].restitution_at(approach), sides[1].restitution_at(approach));
}

double Meet::friction_at(double slip) const {
  if (!has_law()) return friction;
  return std::sqrt(sides[0].friction_at(slip) * sides[1].friction_at(slip));
}

void Impulses::apply(std::span<Mover> movers, const Meet& meet, const Vec3& p, double lever) {
  const auto push = [&](Mover& mover, const Vec3& arm, const Vec3& impulse) {
    const Vec3 dv = mover.inverse_mass * impulse;
    const Vec3 dw = mover.inverse_inertia * arm.cross(impulse);
    mover.velocity += dv;
    mover.spin += dw;
    mover.shift += lever * dv;
    mover.turn += lever * dw;
  };
  push(movers[static_cast<std::size_t>(meet.first)], meet.arm1, p);
  if (meet.second >= 0) push(movers[static_cast<std::size_t>(meet.second)], meet.arm2, -p);
}

Vec3 Impulses::velocity(std::span<const Mover> movers, const Meet& meet) {
  const auto of = [&](int i, const Vec3& arm) {
    const Mover& mover = movers[static_cast<std::size_t>(i)];
    return mover.velocity + mover.spin.cross(arm);
  };
  return of(meet.first, meet.arm1) - (meet.second >= 0 ? of(meet.second, meet.arm2) : meet.ground);
}

void Impulses::prepare(std::span<Mover> movers, std::span<Meet> meets) const {
  for (Meet& m : meets) {
    const Vec3& n = m.normal;
    const Vec3 side = n.cross(std::fabs(n.x()) < 0.8 ? Vec3(1, 0, 0) : Vec3(0, 0, 1));
    m.u = side / side.norm();
    m.v = n.cross(m.u);
    const auto soft = [&](const Vec3& along) {
      double sum = softness(movers[static_cast<std::size_t>(m.first)], m.arm1, along);
      if (m.second >= 0) sum += softness(movers[static_cast<std::size_t>(m.second)], m.arm2, along);
      return sum;
    };
    m.pull_u = m.u.dot(m.pull), m.pull_v = m.v.dot(m.pull);
    m.soft_n = soft(n);
    // Along the surface the larger value of a matrix of 2 x 2.
    const double diagonal = soft((m.u + m.v) / std::sqrt(2.0)), u = soft(m.u), v = soft(m.v);
    const double mixed = diagonal - 0.5 * (u + v);
    m.soft_t = 0.5 * (u + v) + std::sqrt(0.25 * (u - v) * (u - v) + mixed * mixed);
  }
}

// How much an impulse along the normal changes the velocity there, with all that is linked.
double Impulses::linked_softness(std::span<const Mover> movers, const Meet& m) {
  scratch_.assign(movers.begin(), movers.end());
  for (Mover& each : scratch_) each.velocity = each.spin = {};
  apply(scratch_, m, m.normal, 0);
  links_->hold(scratch_, true);
  Vec3 w = velocity(scratch_, m);
  if (m.second < 0) w += m.ground;
  return m.normal.dot(w);
}

double Impulses::moved(std::span<const Mover> movers, const Meet& meet) {
  const auto of = [&](int i, const Vec3& arm) {
    const Mover& mover = movers[static_cast<std::size_t>(i)];
    return mover.shift + mover.turn.cross(arm);
  };
  Vec3 way = of(meet.first, meet.arm1);
  if (meet.second >= 0) way -= of(meet.second, meet.arm2);
  return meet.normal.dot(way);
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
double Impulses::next_touch(std::span<const Mover> movers, const Meet& m, double now,
                            double fastest) {
  const double g = m.path_gap + moved(movers, m), a = m.acceleration,
               v = m.normal.dot(velocity(movers, m)) - m.path_gain;
  double s = now;
  if (g - (v - 0.5 * a * now) * now > m.tiny) {
    if (!(g < 0)) return -1;
    s = time_since(g, v, a, now);
  } else if (g > m.tiny) {
    return -1;
  }
  return v - a * s < -1e-13 * fastest ? s : -1;
}

void Impulses::bounce(std::span<Mover> movers, std::span<Meet> meets, double h) {
  double fastest = 0, now = h;
  for (const Meet& m : meets)
    if (m.active) fastest = std::max(fastest, -m.before);
  std::size_t after = 0;  // the meeting behind the last one: who comes next at the same moment
  for (std::size_t left = kMostBounces * meets.size(); left > 0; --left) {
    std::size_t next = meets.size();
    double earliest = -1, soft = 0;
    for (std::size_t k = 0; k < meets.size(); ++k) {
      const std::size_t at = (after + k) % meets.size();
      const Meet& m = meets[at];
      const double s = next_touch(movers, m, now, fastest);
      if (!(s > earliest)) continue;
      const double own = links_ ? linked_softness(movers, m) : m.soft_n;
      if (!(own > kHeld * m.soft_n)) continue;
      next = at, earliest = s, soft = own;
    }
    if (next == meets.size()) return;
    Meet& m = meets[next];
    now = earliest;
    after = next + 1;
    if (!m.active) m.lever = now;
    m.active = true, m.after = now, m.given = m.path_gain + m.acceleration * now;
    const Vec3 slip = velocity(movers, m);
    const double rate = m.normal.dot(slip) - m.given;
    const double push = -(1 + m.restitution_at(-rate)) * rate / soft;
    const Vec3 along = slip - m.normal.dot(slip) * m.normal;
    const Vec3 pull = within_cone(-along / m.soft_t, m.friction_at(along.norm()) * push);
    apply(movers, m, push * m.normal + pull, now);
    if (links_) links_->hold(movers, false);
  }
}

void Impulses::start(std::span<Mover> movers, std::span<const Meet> meets) const {
  for (const Meet& m : meets)
    if (m.active && m.push > 0)
      apply(movers, m, m.push * m.normal + m.pull_u * m.u + m.pull_v * m.v, m.lever);
  if (links_) links_->hold(movers, false);
}

// There and back.
double Impulses::sweep(std::span<Mover> movers, std::span<Meet> meets) const {
  double change = 0;
  const auto solve = [&](Meet& m) {
    if (!m.active) return;
    const Vec3 w = velocity(movers, m);
    const double push = std::max(0.0, m.push - (m.normal.dot(w) + m.offset) / m.soft_n);
    const double added = push - m.push;
    m.push = push;
    if (added != 0) apply(movers, m, added * m.normal, m.lever);
    change = std::max(change, std::fabs(added) * m.soft_n);
    if (!(m.friction > 0)) return;
    const Vec3 slip = velocity(movers, m);
    double pu = m.pull_u - m.u.dot(slip) / m.soft_t, pv = m.pull_v - m.v.dot(slip) / m.soft_t;
    limit(m.friction * push, pu, pv);
    const double du = pu - m.pull_u, dv = pv - m.pull_v;
    m.pull_u = pu, m.pull_v = pv;
    if (du != 0 || dv != 0) apply(movers, m, du * m.u + dv * m.v, m.lever);
    change = std::max(change, (std::fabs(du) + std::fabs(dv)) * m.soft_t);
  };
  for (Meet& m : meets) solve(m);
  for (std::size_t k = meets.size(); k-- > 0;) solve(meets[k]);
  if (links_ && change > 0) links_->hold(movers, false);
  return change;
}

// What pushes keeps doing so, and what sticks sticks: linear equations, singular where more points
// hold a body than are needed, but consistent.
void Impulses::stick(std::span<Mover> movers, std::span<Meet> meets, double tolerance) {
  const std::size_t count = meets.size();
  search_.resize(count);
  scratch_.resize(movers.size());
  const auto parts = [&](const Meet& m, const Search& s, const Vec3& w) {
    return Vec3(s.push ? m.normal.dot(w) : 0, s.pull ? m.u.dot(w) : 0, s.pull ? m.v.dot(w) : 0);
  };
  const auto scaled = [](const Meet& m, const Vec3& r) {
    return Vec3(r[0] / m.soft_n, r[1] / m.soft_t, r[2] / m.soft_t);
  };
  double energy = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Meet& m = meets[k];
    Search& s = search_[k] = {};
    s.before = {m.push, m.pull_u, m.pull_v};
    s.push = m.active && m.push > 0;
    const double pull = std::sqrt(m.pull_u * m.pull_u + m.pull_v * m.pull_v);
    s.pull = s.push && pull < (1 - 1e-9) * m.friction * m.push;
    if (!s.push) continue;
    s.rest = -parts(m, s, velocity(movers, m) + m.offset * m.normal);
    s.way = scaled(m, s.rest);
    energy += s.rest.dot(s.way);
  }
  for (std::size_t turn = 0; turn < 6 * movers.size() + 20 && energy > 0; ++turn) {
    for (std::size_t i = 0; i < movers.size(); ++i) {
      scratch_[i] = movers[i];
      scratch_[i].velocity = scratch_[i].spin = {};
    }
    for (std::size_t k = 0; k < count; ++k)
      if (const Meet& m = meets[k]; search_[k].push) {
        const Vec3& d = search_[k].way;
        apply(scratch_, m, d[0] * m.normal + d[1] * m.u + d[2] * m.v, 0);
      }
    if (links_) links_->hold(scratch_, true);
    double bend = 0, largest = 0, next = 0;
    for (std::size_t k = 0; k < count; ++k) {
      Search& s = search_[k];
      if (!s.push) continue;
      Vec3 w = velocity(scratch_, meets[k]);
      if (meets[k].second < 0) w += meets[k].ground;
      s.image = parts(meets[k], s, w);
      bend += s.image.dot(s.way);
    }
    if (!(bend > 0)) break;
    for (std::size_t k = 0; k < count; ++k) {
      Search& s = search_[k];
      if (!s.push) continue;
      s.found += energy / bend * s.way;
      s.rest -= energy / bend * s.image;
      largest = std::max(largest, s.rest.cwiseAbs().maxCoeff());
      next += s.rest.dot(scaled(meets[k], s.rest));
    }
    if (largest <= 0.1 * tolerance) break;
    for (std::size_t k = 0; k < count; ++k)
      search_[k].way = scaled(meets[k], search_[k].rest) + next / energy * search_[k].way;
    energy = next;
  }
  for (std::size_t k = 0; k < count; ++k) {
    Meet& m = meets[k];
    const Search& s = search_[k];
    if (!s.push) continue;
    const double push = std::max(0.0, m.push + s.found[0]);
    double pu = m.pull_u + s.found[1], pv = m.pull_v + s.found[2];
    limit(m.friction * push, pu, pv);
    change(movers, m, push, pu, pv);
  }
  if (links_) links_->hold(movers, false);
}

double Impulses::rest(std::span<Mover> movers, std::span<Meet> meets, double tolerance) {
  double change = 0;
  for (int round = 0; round < kMostTurns; ++round) {
    for (int k = 0; k < kFewSweeps * (1 + round); ++k)
      if (change = sweep(movers, meets); change <= tolerance) return change;
    stick(movers, meets, tolerance);
    const double found = sweep(movers, meets);
    if (found <= tolerance) return found;
    if (found > change) set_back(movers, meets);
  }
  for (int k = 0; k < kMostSweeps && change > tolerance; ++k) change = sweep(movers, meets);
  return change;
}

// The impulses before stick(), which did no good.
void Impulses::set_back(std::span<Mover> movers, std::span<Meet> meets) const {
  for (std::size_t k = 0; k < meets.size(); ++k) {
    const Vec3& old = search_[k].before;
    if (meets[k].active) change(movers, meets[k], old[0], old[1], old[2]);
  }
  if (links_) links_->hold(movers, false);
}

}  // namespace sim
