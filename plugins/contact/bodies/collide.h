// Narrow phase: contact manifolds of two shapes.
#pragma once

#include <vector>

#include "collide_hulls.h"
#include "core/particles/collider.h"

namespace sim {

// False for a mesh without a hull, which knows how to touch planes and rooms only.
bool can_collide(const Placed& a);

NearestGap gap_from(const Placed& b, const Vec3& x);

// Appends the points with a gap of at most `margin`. Two boxes use the axis of least overlap among
// the normals of faces and the products of edges (separating axis test, Gottschalk, Lin & Manocha
// 1996), and then the face of one clipped to that of the other, and so do other hulls; spheres and
// capsules use the nearest points of their axes.
void collide(const Placed& a, const Placed& b, double margin, std::vector<ManifoldPoint>& out);

// Contacts of a body and a collider: spheres and capsules use the nearest points of their axes,
// others their corners. Exact for planes and rooms, and for spheres and capsules against everything
// convex.
void collide(const Placed& a, const Collider& b, double t, double margin,
             std::vector<ManifoldPoint>& out);

}  // namespace sim
