// Contacts of surfaces as inequalities between displacements or velocities, and their impulses.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/mat3.h"

namespace sim {

// A free rigid body of four particles at one moment: how an impulse moves them.
struct BodyMotion {
  double inverse_mass = 0;     // 1/kg
  Mat3 inverse_inertia = {};   // 1/(kg m^2), in space
  std::array<Vec3, 4> arms{};  // m, from the center to each
};

// n . sum_k weights_k d_k >= bound, for displacements d of a step (m) or for velocities (m/s). A
// row of one particle, whose other ids are -1, is contact with a collider, and one of two a limit
// of strain; at most it has the four particles of a rigid body, which are the first, and three
// others.
struct ContactRow {
  static constexpr std::size_t kMost = 7;
  std::array<int, kMost> ids{-1, -1, -1, -1, -1, -1, -1};
  std::array<double, kMost> weights{};
  Vec3 normal;
  double bound = 0;
  double slack = 0;                  // misses of this size stay
  double friction = 0;               // the coefficient at its slip
  double gap = 0;                    // m, to be kept at the end
  const BodyMotion* body = nullptr;  // null: its particles move one by one
};

// Contact impulses with friction by projected Gauss-Seidel, row after row in their order, so that
// the bits do not depend on threads. Each impulse acts on both sides alike, which conserves
// momentum, and never pulls. Without friction the kinetic energy of d cannot rise: sum_k m_k
// |d_k|^2 / 2 changes by the dual objective of the rows, which begins at 0 and falls (Moreau 1988).
class ContactImpulses {
 public:
  void clear(std::size_t particles);
  void add(const ContactRow& row, std::span<const double> inverse_mass);
  std::span<const ContactRow> rows() const { return rows_; }
  // Replaces the particles and weights of a row.
  void replace(std::size_t r, const ContactRow& row) { rows_[r] = row; }
  // Begins with zero impulses, with other bounds and one slack for all.
  void begin(std::span<const double> bounds, double slack, std::span<const double> inverse_mass);

  // Marks each particle that an impulse moved in both lists. Ends early once all rows are
  // satisfied. True if there was an impulse.
  bool relax(int sweeps, std::span<const double> inverse_mass, std::span<Vec3> d,
             std::span<std::uint8_t> touched, std::span<std::uint8_t> dirty);
  // Marks particles that have moved since: their rows are evaluated again.
  void note_moved(std::span<const std::uint8_t> which);

 private:
  struct State {
    // Along the normal and, at least, across: 1 / sum w^2 / m; 0 where nothing can move.
    double mass = 0, tangent_mass = 0;
    double normal = 0;
    Vec3 along{};
    std::int64_t seen = -1;  // when it was last looked at
  };

  static State state_of(const ContactRow& row, std::span<const double> inverse_mass);
  bool stale(const ContactRow& row, const State& state) const;

  std::vector<ContactRow> rows_;
  std::vector<State> state_;
  std::vector<std::int64_t> moved_;  // when each particle was last moved
  std::int64_t clock_ = 0;
};

}  // namespace sim
