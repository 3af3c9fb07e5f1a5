// The work of contact for methods whose velocities belong to another time than their positions.
#pragma once

#include "core/math/vec3.h"

namespace sim {

// The energy, J/kg, that contact takes besides the fall of the kinetic energy at the end of a step
// of h from x0, v0, which would lead to x and v without contact; `now` is the velocity after it.
//
// The mean velocity of a step, (x - x0)/h, belongs to its middle, so that u = (x - x0)/h + (v -
// v0)/2 belongs to its end. Methods of first order end with another v: kicks before drifts, as in
// implicit Euler steps, leave it half a step behind, and Euler's method half a step ahead. A
// velocity change dv by contact at u takes |u|^2/2 - |u + dv|^2/2. For methods of higher order u
// equals v to their order.
inline double late_work(double h, const Vec3& x0, const Vec3& v0, const Vec3& x, const Vec3& v,
                        const Vec3& now) {
  return ((x - x0) / h - 0.5 * (v0 + v)).dot(v - now);
}

}  // namespace sim
