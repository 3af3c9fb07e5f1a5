#include "landing_solver.h"

#include <algorithm>
#include <cmath>

#include "core/base/slot.h"

namespace sim {
namespace {

constexpr int kMostLandings = 16;      // times of impact in a step
constexpr double kSlowLanding = 1e-3;  // of the fastest approach: a slower point rests

}  // namespace

double LandingSolver::gap_at(const ContactPoint& m, double time) const {
  return ContactSolver::approach_of(bodies_, m).gap_at(time);
}

// A point that is no faster than forces make its bodies within the step rests.
double LandingSolver::next_touch(const ContactPoint& m) const {
  Approach approach = ContactSolver::approach_of(bodies_, m);
  double gained = bodies_[slot(m.first)].gained;
  if (m.second >= 0) gained = std::max(gained, bodies_[slot(m.second)].gained);
  approach.least = std::max(kSlowLanding * fastest_, gained);
  return approach.next_touch(now_);
}

void LandingSolver::hold(const ContactPoint& m, double time) {
  for (const int body : {m.first, m.second})
    if (body >= 0) held_[slot(body)] = std::max(held_[slot(body)], time);
}

// A gap is known but for what has held its bodies up since they were touched.
double LandingSolver::unknown(const ContactPoint& m, double time) const {
  const double since = std::max(held_[slot(m.first)], m.second >= 0 ? held_[slot(m.second)] : 0.0);
  return since > time ? 0.5 * std::fabs(m.acceleration) * (since - time) * (since - time) : 0;
}

// The points that touch at the next impact; false if none lands after it.
bool LandingSolver::collect_impact(std::span<ContactPoint> contacts) {
  double earliest = -1;
  for (const ContactPoint& m : contacts) earliest = std::max(earliest, next_touch(m));
  const auto touches = [&](const ContactPoint& m) {
    return gap_at(m, earliest) <= m.tiny + unknown(m, earliest);
  };
  if (std::ranges::none_of(
          contacts, [&](const ContactPoint& m) { return next_touch(m) >= 0 && !touches(m); }))
    return false;
  impact_.clear();
  for (ContactPoint& m : contacts) {
    if (!touches(m)) continue;
    if (next_touch(m) >= 0) m.before = 0, m.after = m.duration = earliest, m.active = true;
    ContactPoint& point = impact_.emplace_back(m);
    point.active = true, point.duration = earliest;
    point.offset = -(m.path_gain + m.acceleration * earliest);
    point.normal_impulse = 0, point.friction_impulse = {};
    point.tangent_impulse[0] = point.tangent_impulse[1] = 0;
    ContactSolver::set_arms(bodies_, point, earliest);
  }
  for (const ContactPoint& point : impact_) hold(point, earliest);
  now_ = earliest;
  return true;
}

void LandingSolver::solve(std::span<SolverBody> bodies, std::span<ContactPoint> contacts, double h,
                          double tolerance, RestingSolver& resting, ThreadPool& pool) {
  bodies_ = bodies, now_ = h, fastest_ = 0;
  for (const ContactPoint& m : contacts)
    if (m.active) fastest_ = std::max(fastest_, -m.before);
  held_.assign(bodies.size(), 0);
  for (const ContactPoint& m : contacts)
    if (gap_at(m, h) <= m.tiny) hold(m, h);
  int landings = 0;
  for (; landings < kMostLandings && collect_impact(contacts); ++landings)
    resting.solve(bodies, impact_, tolerance * fastest_, pool);

  for (ContactPoint& m : contacts) {
    const double s = next_touch(m), gap = m.gap + ContactSolver::moved(bodies, m);
    const double rate = m.normal.dot(ContactSolver::velocity(bodies, m));
    if (s >= 0) {
      m.active = true, m.after = s;
      m.given = m.path_gain + m.acceleration * s, m.before = rate - m.given;
      m.duration = rate < 0 ? std::clamp(gap / rate, 0.0, h) : s;
    } else if (landings > 0) {
      m.active = m.active && gap <= m.tiny;
    }
    if (landings > 0 || (s >= 0 && m.second < 0)) ContactSolver::set_arms(bodies, m, m.duration);
  }
}

}  // namespace sim
