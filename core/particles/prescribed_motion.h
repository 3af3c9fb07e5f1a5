// Prescribed motion: kinematic particles, pinned to moving points.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "core/particles/constraints/driven.h"

namespace sim {

// Prescribed positions are known functions p_i(t), which the other particles feel. Their rates in X
// are (p', p''), so that a method finds their positions at its stages to its own order; at the end
// of a step they are set to their paths. Called on one thread.
class PrescribedMotion {
 public:
  using Axes = std::array<double*, 3>;

  // Prescribes particle i from its position `now`: along the path of a motion from there or, if the
  // motion is a function of the scene, along its values. Throws Error{kScene} if these begin
  // elsewhere.
  void add(int i, const Vec3& now, std::shared_ptr<const RigidMotion> motion);

  bool empty() const noexcept { return ids_.empty(); }
  std::span<const int> ids() const noexcept { return ids_; }

  // Changes the entries of prescribed particles only.
  void place(double t, const Axes& q, const Axes& v) const;             // := p(t), p'(t)
  void velocities(double t, const Axes& v) const;                       // := p'(t)
  void chords(double t, double d, const Axes& q, const Axes& v) const;  // := (p(t + d) - q) / d
  void accelerate(double t, const Axes& a) const;                       // := p''(t)

 private:
  std::vector<int> ids_;
  std::vector<Driven> paths_;
};

}  // namespace sim
