// Colliders that are spheres, capsules or boxes, as shapes for the narrow phase.
#pragma once

#include <optional>

#include "core/particles/collider.h"
#include "hull.h"
#include "placed.h"

namespace sim {

// Recognises the shape of a collider by how it is drawn, if its gap agrees: at sample points all
// around it, the gap must be the distance to that shape, less a thickness.
class ColliderShape {
 public:
  // Empty for a plane, a room, an undrawn collider, and one whose gap differs from its drawing.
  static std::optional<ColliderShape> of(const Collider& collider);

  Placed at(const Collider& collider, double t) const;
  double thickness() const { return thickness_; }  // m

 private:
  RigidShape shape_;
  std::optional<Hull> hull_;
  double thickness_ = 0;
};

}  // namespace sim
