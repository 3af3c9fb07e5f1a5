// The path of one particle through a step.
#pragma once

#include <algorithm>

#include "core/math/vec3.h"
#include "core/particles/contact_work_sums.h"

namespace sim {

// The length, m, at least 1, relative to which gaps at x are measured.
inline double position_scale(const Vec3& x) { return std::max(1.0, x.cwiseAbs().maxCoeff()); }

// The fraction of a step below which a particle that leaves a surface and returns counts as resting
// on it.
inline constexpr double kMinFlightTime = 1e-10;
// The fraction of a step that a flight between two impacts takes at least; shorter ones are rest.
inline constexpr double kShortestFlight = 1e-3;

// A cubic path p(s) = c0 + c1 s + c2 s^2 + c3 s^3 for 0 <= s <= 1, in units of the step; and the
// changes by contact at its end.
struct StepPath {
  // Hermite's cubic through both ends of a step of h.
  static StepPath between(double h, const Vec3& x0, const Vec3& v0, const Vec3& x1,
                          const Vec3& v1) {
    const Vec3 r0 = h * v0, r1 = h * v1, d = x1 - x0;
    return {{x0, r0, 3 * d - 2 * r0 - r1, r0 + r1 - 2 * d}};
  }

  Vec3 c[4];
  Vec3 moved{0, 0, 0};            // m, of the end
  Vec3 velocity_change{0, 0, 0};  // m a step, of the velocity at the end
  Vec3 held{0, 0, 0};             // the point of a surface to which it sticks at the end
  bool once = false;  // bounces: rates of methods of first order are not exact enough for more
  bool touched = false, resting = false, sticking = false, over_constrained = false;
  ContactWork work = {};

  Vec3 at(double s) const { return c[0] + s * (c[1] + s * (c[2] + s * c[3])); }
  Vec3 rate(double s) const { return c[1] + s * (2 * c[2] + 3 * s * c[3]); }
  StepPath from(double s) const;  // the same places, as a path whose start is at s
  double length() const { return c[1].norm() + 2 * c[2].norm() + 3 * c[3].norm(); }  // at most

  void shift(const Vec3& by);                      // all of it
  void kick(double s, const Vec3& change);         // the velocity from s on
  void press(double s, const Vec3& acceleration);  // constant from s on
};

}  // namespace sim
