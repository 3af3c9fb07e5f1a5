#include "contact_impulses.h"

#include <algorithm>

#include "core/base/slot.h"
#include "core/particles/contact_law.h"

namespace sim {

void ContactImpulses::clear(std::size_t particles) {
  rows_.clear();
  state_.clear();
  moved_.assign(particles, 0);
  clock_ = 0;
}

void ContactImpulses::add(const ContactRow& row, std::span<const double> inverse_mass) {
  double sum = 0;
  for (std::size_t k = 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k)
    sum += row.weights[k] * row.weights[k] * inverse_mass[slot(row.ids[k])];
  rows_.push_back(row);
  state_.push_back({.mass = sum > 0 ? 1 / sum : 0});
}

void ContactImpulses::begin(std::span<const double> bounds, double slack) {
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    rows_[r].bound = bounds[r];
    rows_[r].slack = slack;
    state_[r] = {.mass = state_[r].mass};
  }
}

bool ContactImpulses::stale(const ContactRow& row, const State& state) const {
  for (const int id : row.ids)
    if (id >= 0 && moved_[slot(id)] > state.seen) return true;
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
        tangent -= (slip - along * row.normal) * state.mass;
        tangent = within_cone(tangent, row.friction * normal);
        impulse += tangent - state.along;
      }
      if (!(impulse.squaredNorm() > row.slack * row.slack * state.mass * state.mass)) continue;
      state.normal = normal;
      state.along = tangent;
      for (std::size_t k = 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k) {
        const std::size_t id = slot(row.ids[k]);
        const double share = row.weights[k] * inverse_mass[id];
        if (share == 0) continue;
        d[id] += share * impulse;
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
