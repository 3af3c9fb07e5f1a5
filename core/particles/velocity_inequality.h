// Inequalities on the velocities of single particles: half-spaces and friction.
#pragma once

#include <vector>

#include "core/math/mat3.h"

namespace sim {

struct HalfSpace {
  Vec3 normal{0, 1, 0};  // of length 1
  double least = 0;      // normal.v >= least, m/s
};

// The point nearest to another one in up to three half-spaces: that one + sum of sizes_k normal_k
// over the active planes, with all sizes >= 0.
struct NearestPoint {
  Vec3 point{0, 0, 0};
  unsigned active = 0;  // a bit a plane
  double sizes[3] = {};
  double miss = 0;  // of the worst plane; more than rounding: the half-spaces have no common point
};
// considered: a bit for each plane that counts.
NearestPoint nearest_point(const HalfSpace* planes, int count, unsigned considered, const Vec3& v);

// Friction on a surface with the normal n and the velocity u, linearised at the slip w: mu |push|
// (v - u) / |v - u| to first order, a constant along w and a drag across it; or, without a
// direction, a drag alone (Kacanov's iteration), which cannot reverse a slip.
struct Friction {
  double drag = 0;                         // kg, mu |push| / |w|
  Vec3 direction{0, 0, 0};                 // w / |w|; or 0
  double size = 0;                         // kg m/s, mu |push|; or 0
  Vec3 normal{0, 1, 0}, carrier{0, 0, 0};  // n; u in m/s

  Mat3 slope() const {
    return drag * (Mat3::Identity() - outer(normal, normal) - outer(direction, direction));
  }
  Vec3 at(const Vec3& v) const { return size * direction + slope() * (v - carrier); }
  // The potential, kg m^2/s^2, of which that is the gradient.
  double potential(const Vec3& v) const {
    const Vec3 slip = v - carrier;
    return size * direction.dot(slip) + 0.5 * slip.dot(slope() * slip);
  }
};

// The contact state of one particle in its stage equation: up to three half-spaces, and friction
// along the first.
struct VelocityInequality {
  static constexpr int kMost = 3;
  static constexpr unsigned kSticking = 1u << kMost;

  int particle = 0, count = 0;
  HalfSpace planes[kMost];
  Friction friction_model;  // on slip
  Vec3 friction{0, 0, 0};   // kg m/s, of that, in the gradient
  bool sticking = false;    // v = held, and nothing else
  Vec3 held{0, 0, 0};       // m/s

  // The active set of the last trial, and the results from the gradient there.
  unsigned at = 0;            // a bit a plane
  unsigned active = 0;        // of these, the ones that push; kSticking where it sticks
  Mat3 free_directions{};     // the projection onto the feasible directions
  Vec3 push{0, 0, 0};         // kg m/s, of the planes on the particle
  double pushes[kMost] = {};  // of each, >= 0
  Vec3 offset{0, 0, 0};       // m/s

  // The nearest velocity that is allowed.
  Vec3 nearest(const Vec3& v);
  // Activates inequalities that v + d violates; `offset` then leads from v onto all active planes.
  // False if there are none.
  bool activates(const Vec3& v, const Vec3& d);
  // The projected gradient, along which the potential can still fall; the rest is the contact
  // force. Inequalities that would have to pull are released.
  Vec3 projected_gradient(const Vec3& gradient, const Vec3& v);

 private:
  void find_free_directions();
};

using VelocityInequalities = std::vector<VelocityInequality>;

}  // namespace sim
