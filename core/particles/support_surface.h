// A surface on which a particle rests from the start of a step on.
#pragma once

#include "core/particles/collider.h"

namespace sim {

struct SupportSurface {
  Collider* collider = nullptr;
  Vec3 normal{0, 1, 0};  // below the particle, at the start of the step

  // Beyond an edge, over which normals turn by more than 60 degrees, the surface goes on along its
  // tangent plane: accelerations are smooth up to where the step is cut then, and a little farther.
  SurfaceSample query(double t, const Vec3& x) const {
    constexpr double kTurned = 0.5;
    SurfaceSample sample = collider->query(t, x);
    if (sample.normal.dot(normal) < kTurned) sample.normal = normal;
    return sample;
  }
};

}  // namespace sim
