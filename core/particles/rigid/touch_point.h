// A shape in its place, and a point where two touch.
#pragma once

#include "core/particles/rigid/rigid_shape.h"

namespace sim {

struct Hull;

// A shape in its place: the columns of `axes` are its axes.
struct Placed {
  const RigidShape* shape = nullptr;
  const Hull* hull = nullptr;  // of a box and of a convex mesh
  Vec3 center;                 // of the frame of the shape, m
  Mat3 axes = Mat3::Identity();
};

struct TouchPoint {
  Vec3 x;           // m, in the middle of the gap
  Vec3 normal;      // of length 1, from the second to the first
  double gap = 0;   // m, < 0 where they overlap
  int feature = 0;  // the same from step to step, as long as the same parts touch
};

}  // namespace sim
