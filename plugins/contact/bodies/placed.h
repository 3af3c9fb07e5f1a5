// A placed shape.
#pragma once

#include "core/particles/rigid/rigid_shape.h"

namespace sim {

struct Hull;

// A placed shape: the columns of `axes` are its axes.
struct Placed {
  const RigidShape* shape = nullptr;
  const Hull* hull = nullptr;  // of a box and of a convex mesh
  Vec3 center;                 // of the frame of the shape, m
  Mat3 axes = Mat3::Identity();
};

}  // namespace sim
