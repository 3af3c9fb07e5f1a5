// The derivative of a spring's force.
#pragma once

#include "core/base/vec3.h"

namespace sim {

// K = -df_a/dx_a = df_a/dx_b of a spring from a to b, d = x_a - x_b:
//   K = along I + across d d^T,  along = k (1 - r/|d|),  across = k r / |d|^3
// K = k I where r = 0, and also where d = 0 has no direction (or |d|^2 underflows).
struct SpringStiffness {
  double along = 0, across = 0;  // N/m, N/m^3
};
SpringStiffness spring_stiffness(const Vec3& d, double k, double rest);

}  // namespace sim
