// Contact laws: restitution along the normal and friction along the surface.
#pragma once

#include <algorithm>
#include <memory>

#include "core/math/vec3.h"

namespace sim {

// A normal and a tangential law. Both are pure, continuous functions of speeds, and dry: friction
// is proportional to the normal force, so that one law holds for the impulses of an impact and for
// the forces of resting contact. Whatever they return within their bounds, contact adds no energy.
class ContactLaw {
 public:
  virtual ~ContactLaw() = default;

  // The coefficient of restitution, 0 .. 1: the share of the normal velocity that an impact at
  // `approach` >= 0 m/s gives back. At 0 m/s it may be 0 only if it is 0 everywhere.
  virtual double restitution(double approach) const = 0;

  // The friction coefficient at a slip of `speed` >= 0 m/s: the largest friction, >= 0, as a share
  // of the normal impulse or force. At 0 m/s it is the coefficient of static friction; it may be 0
  // there only if it is 0 everywhere.
  virtual double friction(double speed) const = 0;

  // True if neither depends on the speed: then it is Coulomb's law with Newton's restitution, which
  // has kernels of its own.
  virtual bool constant() const { return false; }
};

// The material of a collider or a body: its laws of contact.
struct ContactMaterial {
  double restitution = 0;  // 0 .. 1: the share of the normal velocity that a bounce gives back
  double friction = 0;     // Coulomb's coefficient, >= 0
  // Null: Coulomb's law with these numbers. Another law: they are its values at 0 m/s.
  std::shared_ptr<const ContactLaw> law = {};

  double restitution_at(double approach) const {
    return law ? law->restitution(approach) : restitution;
  }
  double friction_at(double speed) const { return law ? law->friction(speed) : friction; }

  // The slip, m/s, that friction removes while the normal velocity changes by `push`, m/s; the
  // coefficient is that of the remaining slip, found by iteration.
  double braking(double speed, double push) const {
    if (!law) return push * friction;
    constexpr int kIterations = 4;
    double taken = 0;
    for (int n = 0; n < kIterations; ++n)
      taken = std::min(speed, push * law->friction(speed - std::max(0.0, taken)));
    return taken;
  }
};

inline ContactMaterial surface_of(std::shared_ptr<const ContactLaw> law) {
  ContactMaterial surface{law->restitution(0), law->friction(0)};
  if (!law->constant()) surface.law = std::move(law);
  return surface;
}

// Coulomb's cone: the tangential vector `pull` shortened to `most`.
inline Vec3 within_cone(const Vec3& pull, double most) {
  const double size = pull.norm();
  return size > most ? Vec3(most / size * pull) : pull;
}

}  // namespace sim
