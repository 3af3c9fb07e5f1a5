// Vectors in arrays of one coordinate each.
#pragma once

#include <array>
#include <cstddef>

#include "core/math/vec3.h"

namespace sim {

template <class Real>
Vec3 vector_at(const std::array<Real*, 3>& axes, int i) {
  return {axes[0][i], axes[1][i], axes[2][i]};
}

inline void put_vector(const std::array<double*, 3>& axes, int i, const Vec3& v) {
  for (std::size_t axis = 0; axis < 3; ++axis) axes[axis][i] = v[axis];
}

}  // namespace sim
