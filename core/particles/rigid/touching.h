// Where two solids touch, or nearly do.
#pragma once

#include <cstddef>
#include <vector>

#include "core/particles/collider.h"
#include "core/particles/rigid/rigid_body.h"

namespace sim {

// A shape in its place: the columns of `axes` are its axes.
struct Placed {
  const RigidShape* shape = nullptr;
  Vec3 center;  // of the frame of the shape, m
  Mat3 axes = Mat3::Identity();
};

struct TouchPoint {
  Vec3 x;           // m, in the middle of the gap
  Vec3 normal;      // of length 1, from the second to the first
  double gap = 0;   // m, < 0 where they overlap
  int feature = 0;  // the same from step to step, as long as the same parts touch
};

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
