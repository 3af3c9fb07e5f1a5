// Narrow phase: contact manifolds of two shapes.
#pragma once

#include <vector>

#include "collide_hulls.h"
#include "core/particles/collider.h"

namespace sim {

// False for a mesh without a hull, which can only collide with planes and rooms.
bool can_collide(const Placed& a);

NearestGap gap_from(const Placed& b, const Vec3& x);

// Appends the contact points with a gap of at most `margin`. Two boxes or hulls use the axis of
// least overlap among face normals and cross products of edges (separating axis test, Gottschalk,
// Lin & Manocha 1996), and clip the face of one to that of the other; spheres and capsules use the
// nearest points of their axes.
void collide(const Placed& a, const Placed& b, double margin, std::vector<ManifoldPoint>& out);

// Contacts of a body and a collider: spheres and capsules use the nearest points of their axes,
// others their corners. Exact for planes and rooms, and for spheres and capsules against everything
// convex.
void collide(const Placed& a, const Collider& b, double t, double margin,
             std::vector<ManifoldPoint>& out);

}  // namespace sim
