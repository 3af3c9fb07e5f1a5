// Colliders that are spheres, capsules or boxes, as shapes for the narrow phase.
#pragma once

#include <optional>

#include "core/particles/collider.h"
#include "hull.h"
#include "placed.h"

namespace sim {

// How a collider is drawn says what it is, if its gap agrees: at some points all around it, it must
// be the distance to that shape, less a thickness.
class ColliderShape {
 public:
  // Nothing for a plane, a room, what is not drawn, and what is not as it is drawn.
  static std::optional<ColliderShape> of(const Collider& collider);

  Placed at(const Collider& collider, double t) const;
  double thickness() const { return thickness_; }  // m

 private:
  RigidShape shape_;
  std::optional<Hull> hull_;
  double thickness_ = 0;
};

}  // namespace sim
