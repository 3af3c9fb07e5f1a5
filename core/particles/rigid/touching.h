// Where two solids touch, or nearly do.
#pragma once

#include <vector>

#include "core/particles/collider.h"
#include "core/particles/rigid/touch_point.h"

namespace sim {

// Whether touching() knows the pair.
bool can_touch(const RigidShape& a, const RigidShape& b);

// Appends the points with a gap of at most `margin`. Of two boxes the axis of least overlap among
// the normals of faces and the products of edges (Gottschalk, Lin & Manocha 1996), and then the
// face of one cut to that of the other; of spheres and capsules what is nearest on their axes.
void touching(const Placed& a, const Placed& b, double margin, std::vector<TouchPoint>& out);

// Of a body and a collider. Exact for planes and rooms, and for a sphere with all; another body
// and a collider of another kind touch at the body's corners.
void touching(const Placed& a, const Collider& b, double t, double margin,
              std::vector<TouchPoint>& out);

}  // namespace sim
