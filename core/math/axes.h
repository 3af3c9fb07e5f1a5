// Vectors in arrays of one coordinate each.
#pragma once

#include <cstddef>

#include "core/math/vec3.h"

namespace sim {

// Axes: three pointers, in an array of either kind.
template <class Axes>
Vec3 vector_at(const Axes& axes, int i) {
  return {axes[0][i], axes[1][i], axes[2][i]};
}

template <class Axes>
void put_vector(const Axes& axes, int i, const Vec3& v) {
  for (std::size_t axis = 0; axis < 3; ++axis) axes[axis][i] = v[axis];
}

}  // namespace sim
