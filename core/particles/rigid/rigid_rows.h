// The rigidity constraints between the four particles of each body.
#pragma once

#include <string>
#include <vector>

#include "core/particles/constraint.h"
#include "core/particles/rigid/rigid_body.h"

namespace sim {

// Six equations a body, of its axes d_k: those have length 1 and right angles between them. Near
// the truth each touches a direction of its own, whatever the form of the body, so that the matrix
// of multipliers is all but diagonal.
class RigidRows final : public Constraint {
 public:
  explicit RigidRows(std::vector<RigidBody> bodies) : bodies_(std::move(bodies)) {}

  RowPattern pattern() const override;
  void evaluate(const ParticleView& view, const Rows& rows) const override;
  std::string name(int row) const override { return "body " + std::to_string(row / kRows); }

 private:
  static constexpr int kRows = 6;

  std::vector<RigidBody> bodies_;
};

}  // namespace sim
