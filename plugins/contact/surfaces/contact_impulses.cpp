#include "contact_impulses.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/slot.h"
#include "core/particles/contact_law.h"

namespace sim {
namespace {

constexpr std::size_t kOfBody = 4;  // particles

// The arm of the point of a row on its body, m, and the share with which it counts, 1 or -1.
std::pair<Vec3, double> lever(const ContactRow& row) {
  Vec3 arm = Vec3::Zero();
  double side = 0;
  for (std::size_t k = 0; k < kOfBody; ++k)
    arm += row.weights[k] * row.body->arms[k], side += row.weights[k];
  return {arm, side};
}

}  // namespace

// An impulse p on a row moves its point on a body by side^2 p / m + (I^-1 (r x p)) x r. Across the
// normal the response is bounded by its largest eigenvalue there.
ContactImpulses::State ContactImpulses::state_of(const ContactRow& row,
                                                 std::span<const double> inverse_mass) {
  double sum = 0;
  for (std::size_t k = row.body ? kOfBody : 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k)
    sum += row.weights[k] * row.weights[k] * inverse_mass[slot(row.ids[k])];
  if (!row.body) return {.mass = sum > 0 ? 1 / sum : 0, .tangent_mass = sum > 0 ? 1 / sum : 0};
  const auto [arm, side] = lever(row);
  const auto response = [&, &arm = arm, &side = side](const Vec3& p) {
    return (sum + side * side * row.body->inverse_mass) * p +
           (row.body->inverse_inertia * arm.cross(p)).cross(arm);
  };
  const Vec3& n = row.normal;
  const Vec3 u = n.cross(std::abs(n.x()) < 0.6 ? Vec3(1, 0, 0) : Vec3(0, 1, 0)).normalized(),
             v = n.cross(u), along_u = response(u);
  const double a = u.dot(along_u), b = v.dot(along_u), c = v.dot(response(v));
  return {.mass = 1 / n.dot(response(n)),
          .tangent_mass = 1 / (0.5 * (a + c) + std::sqrt(0.25 * (a - c) * (a - c) + b * b))};
}

void ContactImpulses::clear(std::size_t particles) {
  rows_.clear();
  state_.clear();
  moved_.assign(particles, 0);
  clock_ = 0;
}

void ContactImpulses::add(const ContactRow& row, std::span<const double> inverse_mass) {
  rows_.push_back(row);
  state_.push_back(state_of(row, inverse_mass));
}

void ContactImpulses::begin(std::span<const double> bounds, double slack,
                            std::span<const double> inverse_mass) {
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    rows_[r].bound = bounds[r];
    rows_[r].slack = slack;
    state_[r] = state_of(rows_[r], inverse_mass);
  }
}

bool ContactImpulses::stale(const ContactRow& row, const State& state) const {
  for (std::size_t k = 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k)
    if (moved_[slot(row.ids[k])] > state.seen) return true;
  return state.seen < 0;
}

bool ContactImpulses::relax(int sweeps, std::span<const double> inverse_mass, std::span<Vec3> d,
                            std::span<std::uint8_t> touched, std::span<std::uint8_t> dirty) {
  bool busy = true, any = false;
  for (int sweep = 0; sweep < sweeps && busy; ++sweep) {
    busy = false;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const ContactRow& row = rows_[r];
      State& state = state_[r];
      if (state.mass == 0 || !stale(row, state)) continue;
      state.seen = ++clock_;
      Vec3 slip = Vec3::Zero();
      for (std::size_t k = 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k)
        slip += row.weights[k] * d[slot(row.ids[k])];
      const double along = row.normal.dot(slip);
      const double normal = std::max(0.0, state.normal + (row.bound - along) * state.mass);
      Vec3 impulse = (normal - state.normal) * row.normal;
      Vec3 tangent = state.along;
      if (row.friction > 0) {
        tangent -= (slip - along * row.normal) * state.tangent_mass;
        tangent = within_cone(tangent, row.friction * normal);
        impulse += tangent - state.along;
      }
      if (!(impulse.squaredNorm() > row.slack * row.slack * state.mass * state.mass)) continue;
      state.normal = normal;
      state.along = tangent;
      const auto [arm, side] = row.body ? lever(row) : std::pair(Vec3::Zero(), 0.0);
      const Vec3 turn = row.body ? row.body->inverse_inertia * arm.cross(impulse) : Vec3::Zero();
      for (std::size_t k = 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k) {
        const std::size_t id = slot(row.ids[k]);
        const double share = row.weights[k] * inverse_mass[id];
        if (row.body && k < kOfBody)
          d[id] += side * row.body->inverse_mass * impulse + turn.cross(row.body->arms[k]);
        else if (share != 0)
          d[id] += share * impulse;
        else
          continue;
        moved_[id] = clock_ + 1;
        touched[id] = dirty[id] = 1;
      }
      busy = any = true;
    }
  }
  return any;
}

void ContactImpulses::note_moved(std::span<const std::uint8_t> which) {
  ++clock_;
  for (std::size_t i = 0; i < which.size(); ++i)
    if (which[i]) moved_[i] = clock_;
}

}  // namespace sim
