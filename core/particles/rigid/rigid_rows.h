// The rigidity constraints between the four particles of each body.
#pragma once

#include <string>
#include <vector>

#include "core/base/thread_pool.h"
#include "core/particles/constraint.h"
#include "core/particles/rigid/rigid_body.h"

namespace sim {

// Six equations a body, for its axes d_k: unit lengths and right angles. Where they are obeyed, the
// gradients of the six are orthogonal, whatever the shape of the body.
class RigidRows final : public Constraint {
 public:
  // pool: its threads share the bodies.
  RigidRows(std::vector<RigidBody> bodies, ThreadPool& pool)
      : bodies_(std::move(bodies)), pool_(&pool) {}

  RowPattern pattern() const override;
  void evaluate(const ParticleView& view, const Rows& rows) const override;
  bool orthogonal() const override { return true; }
  std::string name(int row) const override { return "body " + std::to_string(row / kRows); }

 private:
  static constexpr int kRows = 6;

  void evaluate_some(const ParticleView& view, const Rows& rows, int begin, int end) const;

  std::vector<RigidBody> bodies_;
  ThreadPool* pool_;
};

}  // namespace sim
