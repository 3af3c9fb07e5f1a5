// One contact point by itself, with Coulomb friction.
#pragma once

#include "core/math/mat3.h"

namespace sim {

// The velocity response of a contact point to an impulse there: W, in 1/kg, symmetric, along the
// normal and two tangents.
struct PointResponse {
  Mat3 response, inverse = {};  // W; its inverse, where `regular`
  bool regular = false;

  static PointResponse of(const Mat3& response);
};

// P(a), whose fixed point P(p - s w) = p is the solution for any s > 0 (Alart & Curnier (1991)):
// the normal part max(0, a_n), and the tangential one within the friction that this allows. slope:
// its derivative.
Vec3 within_coulomb(const Vec3& a, double friction, Mat3* slope = nullptr);

// The impulse p, N s, with which this point alone obeys Signorini's and Coulomb's laws: p = 0 and
// w_n >= 0; or w = 0 and |p_t| <= friction p_n; or w_n = 0, w_t != 0 and p_t = -friction p_n w_t /
// |w_t|. On entry it has the impulse `p` and the velocity w, m/s. Exact to rounding, for a slipping
// point by Newton's method on the direction of the slip; a single step towards it if friction jams
// the point (Painleve).
Vec3 coulomb_impulse(const PointResponse& of, double friction, const Vec3& w, const Vec3& p);

// R with R R^T = m, lower triangular (Cholesky); 0 of a particle, whose m is 0.
Mat3 cholesky_root(const Mat3& m);

}  // namespace sim
