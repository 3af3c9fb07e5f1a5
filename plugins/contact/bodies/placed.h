// A placed shape.
#pragma once

#include "core/particles/rigid/rigid_body.h"

namespace sim {

struct Hull;

// The cosine of 2.6 degrees: nearly parallel faces touch as faces, at several points, whose gaps
// along the face normal differ from those along the edges' axis by 1e-3 of them.
inline constexpr double kNearlyParallel = 1 - 1e-3;

// A placed shape: the columns of `axes` are its axes.
struct Placed {
  const RigidShape* shape = nullptr;
  const Hull* hull = nullptr;  // of a box and of a convex mesh
  Vec3 center;                 // of the frame of the shape, m
  Mat3 axes = Mat3::Identity();
};

}  // namespace sim
