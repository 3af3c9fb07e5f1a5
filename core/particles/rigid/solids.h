// The bodies of a scene, its colliders and its single particles: where they touch.
#pragma once

#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/particles/particles.h"
#include "core/particles/rigid/collider_shape.h"
#include "core/particles/rigid/rigid_body.h"
#include "core/particles/rigid/touching.h"

namespace sim {

struct SolidsSpec {
  std::vector<RigidBody> bodies;
  std::vector<bool> touch{};               // whether each does
  int singles = 0;                         // the first particles, which are no bodies'
  std::set<std::pair<int, int>> tied{};    // a body and one of these: they do not touch
  std::set<std::pair<int, int>> joined{};  // nor do these bodies, of which the first has less
};

// Bodies have the first numbers; what has a higher one is a point: a single particle.
class Solids {
 public:
  // Throws Error{kScene} for pairs that nothing knows how to touch, and for what overlaps at the
  // start.
  Solids(SolidsSpec spec, const Particles& particles, const double* initial);

  int bodies() const { return static_cast<int>(spec_.bodies.size()); }
  int singles() const { return spec_.singles; }
  const RigidBody& body(int i) const { return spec_.bodies[static_cast<std::size_t>(i)]; }
  bool touches(int i) const { return spec_.touch[static_cast<std::size_t>(i)]; }
  double radius(int i) const { return radii_[static_cast<std::size_t>(i)]; }  // m, a ball around it
  // m, the least half thickness: what moves less cannot be missed.
  double thinness(int i) const;
  bool are_tied(int body, int particle) const;
  bool are_joined(int i, int j) const;  // two bodies

  // Appends the points with a gap of at most `margin` of two of them in these states, of which the
  // first is a body, and of one and a collider.
  void touch(int first, const RigidState& a, int second, const RigidState& b, double margin,
             std::vector<TouchPoint>& out) const;
  void touch(int first, const RigidState& a, std::size_t collider, double t, double margin,
             std::vector<TouchPoint>& out) const;

 private:
  Placed placed(int i, const RigidState& state) const;
  const ColliderShape* shape_of(const Collider& collider) const;  // null where it has none
  void check_start(const double* initial) const;
  void check_pair(int i, int j, const RigidState& a, const RigidState& b) const;
  void check_collider(int i, const RigidState& a, std::size_t collider) const;

  SolidsSpec spec_;
  const Particles* particles_;
  std::vector<double> radii_;
  std::vector<std::optional<Hull>> hulls_;
  std::vector<std::pair<const Collider*, ColliderShape>> shapes_;  // as bodies with faces see them
};

}  // namespace sim
