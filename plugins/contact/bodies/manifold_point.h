// A contact point of two bodies, or of a body and a collider.
#pragma once

#include <cstdint>

#include "core/math/vec3.h"

namespace sim {

struct ManifoldPoint {
  Vec3 x;                    // m, in the middle of the gap
  Vec3 normal;               // of length 1, from the second to the first
  double gap = 0;            // m, < 0 where they overlap
  std::int64_t feature = 0;  // the same from step to step, as long as the same parts touch
  // m, from a point that turns with the first, as a corner or the end of a capsule does; < 0: from
  // none, as it slides over the first.
  double rounding = -1;
};

}  // namespace sim
