// Contacts as inequalities between motions, and their impulses.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/math/vec3.h"

namespace sim {

// n . sum_k weights_k d_k >= bound, of the ways d of a step (m) or of velocities (m/s). A row of
// one particle, whose other ids are -1, is one of a collider.
struct ContactRow {
  std::array<int, 4> ids{-1, -1, -1, -1};
  std::array<double, 4> weights{};
  Vec3 normal;
  double bound = 0;
  double slack = 0;     // misses of this size stay
  double friction = 0;  // Coulomb's
  double gap = 0;       // m, to be kept at the end
};

// Impulses along the rows that need them, with friction against the slip: projected Gauss-Seidel,
// row after row in their order, so that the bits are one thread's. Each impulse acts on both sides
// alike, which keeps momentum; it never pulls.
// Without friction the kinetic energy of d cannot rise: sum_k m_k |d_k|^2 / 2 changes by the dual
// objective of the rows, which begins at 0 and falls (Moreau 1988).
class ContactRows {
 public:
  void clear(std::size_t particles);
  void add(const ContactRow& row, std::span<const double> inverse_mass);
  std::span<const ContactRow> rows() const { return rows_; }
  bool pressed(std::size_t row) const { return state_[row].normal > 0; }
  // From no impulses on; `bound_of(row)` and `slack_of(row)` replace what rows say.
  template <class BoundOf>
  void begin(const BoundOf& bound_of, double slack);

  // `changed` hears of each particle that an impulse moved. Ends early where nothing is left to do.
  template <class Changed>
  void relax(int sweeps, std::span<const double> inverse_mass, std::span<Vec3> d,
             const Changed& changed);

 private:
  struct State {
    double mass = 0;  // 1 / sum w^2 / m; 0 where nothing can move
    double normal = 0;
    Vec3 along{};
    std::int64_t seen = -1;  // when it was last looked at
  };

  bool stale(const ContactRow& row, const State& state) const {
    for (const int id : row.ids)
      if (id >= 0 && moved_[static_cast<std::size_t>(id)] > state.seen) return true;
    return state.seen < 0;
  }

  std::vector<ContactRow> rows_;
  std::vector<State> state_;
  std::vector<std::int64_t> moved_;  // when each particle was last moved
  std::int64_t clock_ = 0;
};

template <class BoundOf>
void ContactRows::begin(const BoundOf& bound_of, double slack) {
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    rows_[r].bound = bound_of(rows_[r]);
    rows_[r].slack = slack;
    state_[r] = {.mass = state_[r].mass};
  }
}

template <class Changed>
void ContactRows::relax(int sweeps, std::span<const double> inverse_mass, std::span<Vec3> d,
                        const Changed& changed) {
  bool busy = true;
  for (int sweep = 0; sweep < sweeps && busy; ++sweep) {
    busy = false;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const ContactRow& row = rows_[r];
      State& state = state_[r];
      if (state.mass == 0 || !stale(row, state)) continue;
      state.seen = ++clock_;
      Vec3 slip = Vec3::Zero();
      for (std::size_t k = 0; k < 4 && row.ids[k] >= 0; ++k)
        slip += row.weights[k] * d[static_cast<std::size_t>(row.ids[k])];
      const double along = row.normal.dot(slip);
      const double more = (row.bound - along) * state.mass;
      const double normal = std::max(0.0, state.normal + more);
      Vec3 impulse = (normal - state.normal) * row.normal;
      Vec3 tangent = state.along;
      if (row.friction > 0) {
        tangent -= (slip - along * row.normal) * state.mass;
        const double most = row.friction * normal, size = tangent.norm();
        if (size > most) tangent *= size > 0 ? most / size : 0.0;
        impulse += tangent - state.along;
      }
      if (!(impulse.squaredNorm() > row.slack * row.slack * state.mass * state.mass)) continue;
      state.normal = normal;
      state.along = tangent;
      for (std::size_t k = 0; k < 4 && row.ids[k] >= 0; ++k) {
        const auto id = static_cast<std::size_t>(row.ids[k]);
        const double share = row.weights[k] * inverse_mass[id];
        if (share == 0) continue;
        d[id] += share * impulse;
        moved_[id] = clock_ + 1;
        changed(id);
      }
      busy = true;
    }
  }
}

}  // namespace sim
