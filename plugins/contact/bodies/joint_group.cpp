#include "joint_group.h"

#include <algorithm>
#include <cmath>

#include "coulomb_point.h"

namespace sim {

RowPattern JointGroup::nodes_of(std::span<const Member> members, const RowPattern& pattern) {
  RowPattern nodes;
  for (int r = 0; r < pattern.rows(); ++r) {
    for (const int m : pattern.of(r)) {
      nodes.ids.push_back(2 * m);
      if (members[static_cast<std::size_t>(m)].body >= 0) nodes.ids.push_back(2 * m + 1);
    }
    nodes.begin.push_back(static_cast<int>(nodes.ids.size()));
  }
  return nodes;
}

JointGroup::JointGroup(std::vector<Member> members, RowPattern pattern, std::vector<int> rows)
    : members_(std::move(members)),
      pattern_(std::move(pattern)),
      rows_(std::move(rows)),
      terms_(pattern_.ids.size()),
      drive_(rows_.size()),
      rest_(rows_.size()),
      weights_(2 * members_.size(), 1.0),
      change_(members_.size()),
      matrix_(nodes_of(members_, pattern_), weights_) {
  gradient_.reserve(2 * terms_.size());
}

// The moment of I^-1 = R R^T is R^T times it, of the weight 1.
void JointGroup::factorise(std::span<const SolverBody> bodies) {
  gradient_.clear();
  for (std::size_t m = 0; m < members_.size(); ++m) weights_[2 * m] = members_[m].inverse_mass;
  for (std::size_t e = 0; e < terms_.size(); ++e) {
    const Member& member = members_[static_cast<std::size_t>(pattern_.ids[e])];
    gradient_.push_back(terms_[e].along);
    if (member.body < 0) continue;
    const Mat3& inertia = bodies[static_cast<std::size_t>(member.place)].inverse_inertia;
    gradient_.push_back(transposed(cholesky_root(inertia)) * terms_[e].moment);
  }
  matrix_.factorise(gradient_, weights_);
}

void JointGroup::project(std::span<SolverBody> bodies, What what) {
  if (what == What::kChanges) std::ranges::fill(change_, Vec3());
  const auto velocity = [&](std::size_t m) -> Vec3& {
    if (what == What::kChanges) return change_[m];
    if (what == What::kDisplacements) return members_[m].shift;
    return what == What::kMoves ? members_[m].moved : members_[m].velocity;
  };
  const bool displaces = what == What::kDisplacements;
  bool any = false;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    double sum = what == What::kVelocities ? drive_[r] : 0;
    for (auto e = static_cast<std::size_t>(pattern_.begin[r]);
         e < static_cast<std::size_t>(pattern_.begin[r + 1]); ++e) {
      const auto m = static_cast<std::size_t>(pattern_.ids[e]);
      const int place = members_[m].place;
      if (place < 0) {
        sum += terms_[e].along.dot(velocity(m));
        continue;
      }
      const SolverBody& body = bodies[static_cast<std::size_t>(place)];
      sum += terms_[e].along.dot(displaces ? body.translation : body.velocity) +
             terms_[e].moment.dot(displaces ? body.rotation : body.angular_velocity);
    }
    rest_[r] = sum;
    any = any || sum != 0;
  }
  if (!any) return;
  matrix_.solve(rest_.data());
  for (std::size_t r = 0; r < rows_.size(); ++r)
    for (auto e = static_cast<std::size_t>(pattern_.begin[r]);
         e < static_cast<std::size_t>(pattern_.begin[r + 1]); ++e) {
      const auto m = static_cast<std::size_t>(pattern_.ids[e]);
      const Vec3 along = members_[m].inverse_mass * rest_[r] * terms_[e].along;
      const int place = members_[m].place;
      if (place < 0) {
        velocity(m) -= along;
        continue;
      }
      SolverBody& body = bodies[static_cast<std::size_t>(place)];
      (displaces ? body.translation : body.velocity) -= along;
      (displaces ? body.rotation : body.angular_velocity) -=
          body.inverse_inertia * (rest_[r] * terms_[e].moment);
    }
}

}  // namespace sim
