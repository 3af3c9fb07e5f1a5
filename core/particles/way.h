// The way of one particle through a step.
#pragma once

#include "core/math/vec3.h"
#include "core/particles/contact_ledger.h"

namespace sim {

// p(s) = c0 + c1 s + c2 s^2 + c3 s^3 for 0 <= s <= 1, in units of the step; what touches have
// changed at its end.
struct Way {
  Vec3 c[4];
  Vec3 moved{0, 0, 0};   // m, of the end
  Vec3 kicked{0, 0, 0};  // m a step, of the velocity at the end
  Vec3 held{0, 0, 0};    // where it sticks to a surface at the end
  bool touched = false, pressed = false, stuck = false, squeezed = false;
  ContactWork work = {};

  Vec3 at(double s) const { return c[0] + s * (c[1] + s * (c[2] + s * c[3])); }
  Vec3 rate(double s) const { return c[1] + s * (2 * c[2] + 3 * s * c[3]); }
  double length() const { return c[1].norm() + 2 * c[2].norm() + 3 * c[3].norm(); }  // at most

  void shift(const Vec3& by);                      // all of it
  void kick(double s, const Vec3& change);         // the velocity from s on
  void press(double s, const Vec3& acceleration);  // constant from s on
};

}  // namespace sim
