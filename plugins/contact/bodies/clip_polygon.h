// Clipping of a convex polygon by half planes, for contact manifolds.
#pragma once

#include <array>

#include "core/math/vec3.h"

namespace sim {

// A polygon of at most kRoom corners, clipped by half planes one after the other.
template <std::size_t kRoom>
struct ClippedPolygon {
  std::array<Vec3, kRoom> x;
  std::array<int, kRoom> feature{};
  std::size_t count = 0;

  void add(const Vec3& point, int of) {
    if (count < kRoom) x[count] = point, feature[count] = of, ++count;
  }

  // The part of the polygon in n.x <= most (Sutherland & Hodgman 1974). New corners are identified
  // by the side.
  ClippedPolygon clip(const Vec3& n, double most, int side) const {
    ClippedPolygon kept;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t j = (i + 1) % count;
      const double here = n.dot(x[i]) - most, there = n.dot(x[j]) - most;
      if (here <= 0) kept.add(x[i], feature[i]);
      if ((here <= 0) != (there <= 0))
        kept.add(x[i] + here / (here - there) * (x[j] - x[i]), 8 * side + feature[i] + 100);
    }
    return kept;
  }
};

}  // namespace sim
