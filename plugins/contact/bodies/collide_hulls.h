// Narrow phase of two convex hulls, and the distance of a point from one.
#pragma once

#include <vector>

#include "manifold_point.h"
#include "placed.h"

namespace sim {

// Collides two shapes with hulls. The axis of least overlap is sought among the face normals and
// the cross products of those edges whose arcs cross on the Gauss map (Gregorius (2013), Game
// Developers Conference). Then the face of one is clipped to that of the other.
void collide_hulls(const Placed& a, const Placed& b, double margin,
                   std::vector<ManifoldPoint>& out);

struct NearestGap {
  double gap;   // m, < 0 inside
  Vec3 normal;  // away from the solid, of length 1
};

NearestGap gap_from_hull(const Placed& b, const Vec3& x);

}  // namespace sim
