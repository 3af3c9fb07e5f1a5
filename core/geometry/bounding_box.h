// The bounding box of some particles, and their largest motion in a step: many at a time.
#pragma once

namespace sim {

struct BoundingBox {
  double least[3], most[3];     // of the coordinates q
  double fastest[2], farthest;  // squared: of two velocities, and of |q - from|
};

// The extent of particles [begin, end), one at least; `from` may be null. Coordinates and squares
// that are not a number are left out.
using BoundingBoxOf = BoundingBox (*)(const double* const q[3], const double* const v0[3],
                                      const double* const v1[3], const double* const* from,
                                      int begin, int end);
BoundingBoxOf bounding_box_of();  // for this machine

}  // namespace sim
