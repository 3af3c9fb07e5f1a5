// One contact point by itself, with Coulomb friction.
#pragma once

#include "core/math/mat3.h"

namespace sim {

// How an impulse at a point changes the velocity there: W, in 1/kg, symmetric, along the normal and
// two directions of the surface.
struct PointResponse {
  Mat3 response, inverse = {};  // W; its inverse, where `regular`
  bool regular = false;

  static PointResponse of(const Mat3& response);
};

// The impulse p, N s, with which this point alone obeys Signorini's and Coulomb's laws: p = 0 and
// w_n >= 0; or w = 0 and |p_t| <= friction p_n; or w_n = 0, w_t != 0 and p_t = -friction p_n w_t /
// |w_t|. Now it has the impulse `p` and the velocity w, m/s. To rounding, where it slips by
// Newton's method on the direction of the slip; one step towards it where friction jams the point
// (Painleve).
Vec3 coulomb_impulse(const PointResponse& of, double friction, const Vec3& w, const Vec3& p);

}  // namespace sim
