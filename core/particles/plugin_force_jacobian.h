// The Jacobian of plugin forces, which are neither affine nor springs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/base/thread_pool.h"
#include "core/particles/force.h"
#include "core/particles/particles.h"

namespace sim {

// Uses the Jacobian blocks of each force, or central differences of accumulate().
class PluginForceJacobian {
 public:
  struct Block {
    int i, j;
    Mat3 value;
  };

  explicit PluginForceJacobian(const Particles& particles);

  bool empty() const { return with_blocks_.empty() && without_.empty(); }
  std::span<Force* const> without_blocks() const { return without_; }
  // The pairs that blocks may couple, at any state; empty if some force does not know them.
  std::optional<std::vector<std::array<int, 2>>> couplings() const;
  std::int64_t evaluations() const { return evaluations_; }  // of these, so far

  // Chooses the point; the arrays of the view must stay as they are until the last add().
  void at(const ParticleView& view);

  // sink += df/dx dq + df/dv dv of all forces, for all particles, in N.
  void add(const double* const dq[3], const double* const dv[3], ForceSink sink);

  // The blocks at the point.
  std::span<const Block> position_blocks() const { return position_; }
  std::span<const Block> velocity_blocks() const { return velocity_; }

 private:
  void give_blocks(JacobianSink& sink);
  void make_room();
  void add_differences(const double* const dq[3], const double* const dv[3], ForceSink sink);

  const Particles* particles_;
  std::vector<Force*> with_blocks_, without_;
  std::vector<Block> position_, velocity_;
  ParticleView view_;
  Layout half_;
  Array moved_, sums_;  // three coordinates each
  std::int64_t evaluations_ = 0;
};

}  // namespace sim
