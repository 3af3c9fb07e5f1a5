// Rotations by small angles.
#pragma once

#include "core/math/mat3.h"

namespace sim {

// Rotates r by the angle vector w, to third order, as an exact rotation (Cayley transform).
inline Vec3 turned_over(const Vec3& r, const Vec3& w) {
  const Vec3 half = 0.5 * w, across = half.cross(r);
  return r + 2 / (1 + half.squaredNorm()) * (across + half.cross(across));
}

inline Mat3 turned_over(const Mat3& axes, const Vec3& w) {
  return transposed({turned_over(axes.column(0), w), turned_over(axes.column(1), w),
                     turned_over(axes.column(2), w)});
}

}  // namespace sim
