// The derivative of the force of one spring.
#pragma once

#include "core/math/vec3.h"

namespace sim {

// -df_a/dx_a = df_a/dx_b of a spring from a to b, d = x_a - x_b:
//   along I + across d d^T,  along = k (1 - r/|d|),  across = (k - along) / |d|^2
// k I where r = 0, and also where d = 0 has no direction (or |d|^2 underflows). A compressed spring
// has along < 0; clamped, along = max(0, k (1 - r/|d|)), the nearest that is not indefinite.
struct SpringStiffness {
  double along = 0, across = 0;  // N/m, N/m^3
};
SpringStiffness spring_stiffness(const Vec3& d, double k, double rest, bool clamped = false);

// The same with the tension that follows from d = `before` to first order, k (d.u - r) with u the
// unit vector of `before`: along = k (d.u - r) / |d|. The rotation of a spring lengthens it only to
// second order; the tension that results is an artefact of the linearisation, and Newton steps
// without it are as long as those of inextensible bodies. Magisano, Leonetti & Garcea (2017), Int.
// J. Numer. Meth. Engng 109(4), 547-575. Same as above where d has rotated by more than 60 degrees.
SpringStiffness predicted_stiffness(const Vec3& d, const Vec3& before, double k, double rest,
                                    bool clamped);

}  // namespace sim
