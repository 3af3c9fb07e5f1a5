// What colliders do to the way of one particle through a step.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/particles/collider.h"

namespace sim {

// p(s) = c0 + c1 s + c2 s^2 + c3 s^3 for 0 <= s <= 1, in units of the step; what touches have
// changed at its end.
struct Way {
  Vec3 c[4];
  Vec3 moved{0, 0, 0};   // m, of the end
  Vec3 kicked{0, 0, 0};  // m a step, of the velocity at the end
  bool touched = false, pressed = false;

  Vec3 at(double s) const { return c[0] + s * (c[1] + s * (c[2] + s * c[3])); }
  Vec3 rate(double s) const { return c[1] + s * (2 * c[2] + 3 * s * c[3]); }
  double length() const { return c[1].norm() + 2 * c[2].norm() + 3 * c[3].norm(); }  // at most

  void shift(const Vec3& by);                      // all of it
  void kick(double s, const Vec3& change);         // the velocity from s on
  void press(double s, const Vec3& acceleration);  // constant from s on
};

// Touches inside a step, of second order in the step whatever the method: the touch is found on the
// particle's own way, Newton's restitution acts there, and a particle that would be inside at the
// end all the same is pressed on from there on, as by a multiplier along the normal: in the first
// half of what is left of the step here, in the second at its end, by hold(). Moreau (1988);
// Kaufman & Pai (2012), SIAM J. Sci. Comput. 34(6).
class Contacts {
 public:
  // Throws Error{kScene} with the first free particle that is inside at the start.
  void add(std::unique_ptr<Collider> collider, const std::string& name,
           const ParticleView& initial);

  bool empty() const noexcept { return colliders_.empty(); }

  std::vector<Solid> solids(double t) const;  // in the order they were added

  // near[i - tile.begin] := 1 where a way that ends here, at most `way` long, may touch something.
  void near(double t, double h, const ParticleView& end, Tile tile, double way,
            std::uint8_t* near) const;

  // Changes the way of a step from t on so that it ends outside of all colliders.
  void settle(double t, double h, Way& way) const;

  // v := the velocity of a particle that is pressed on at x, without what leads inside.
  Vec3 hold(double t, const Vec3& x, Vec3 v) const;

 private:
  std::vector<std::unique_ptr<Collider>> colliders_;
};

}  // namespace sim
