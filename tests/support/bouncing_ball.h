// The closed form of a ball that bounces on a plane: flights from v e, v e^2, .., each of
// 2 v e^n / g.
#pragma once

#include <cmath>

#include "tests/support/scenes.h"

namespace sim_test {

// Its height, m, a time t after an impact at `speed` that gives back the share e of it.
inline double height_after_impact(double t, double speed, double e) {
  double up = e * speed;
  for (; up > 1e-12 && t >= 2 * up / kGravity; up *= e) t -= 2 * up / kGravity;
  return up > 1e-12 ? up * t - 0.5 * kGravity * t * t : 0;
}

// The height of one that is dropped from `height`, m.
inline double bouncing_height(double height, double t, double e) {
  const double speed = std::sqrt(2 * kGravity * height), fall = speed / kGravity;
  return t < fall ? height - 0.5 * kGravity * t * t : height_after_impact(t - fall, speed, e);
}

}  // namespace sim_test
