// Where two solids touch, or nearly do.
#pragma once

#include <vector>

#include "core/particles/collider.h"
#include "touching_hulls.h"

namespace sim {

// False for a mesh without a hull, which knows how to touch planes and rooms only.
bool can_touch(const Placed& a);

NearestGap gap_from(const Placed& b, const Vec3& x);

// Appends the points with a gap of at most `margin`. Of two boxes the axis of least overlap among
// the normals of faces and the products of edges (Gottschalk, Lin & Manocha 1996), and then the
// face of one cut to that of the other; so of other hulls; of spheres and capsules what is nearest
// on their axes.
void touching(const Placed& a, const Placed& b, double margin, std::vector<TouchPoint>& out);

// Of a body and a collider: of spheres and capsules what is nearest on their axes, of others the
// corners. Exact for planes and rooms, and for spheres and capsules with all that is convex.
void touching(const Placed& a, const Collider& b, double t, double margin,
              std::vector<TouchPoint>& out);

}  // namespace sim
