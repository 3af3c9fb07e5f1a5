// The acceleration of a particle in resting contact with surfaces.
#pragma once

#include <span>

#include "core/particles/support_surface.h"

namespace sim {

inline constexpr double kDifferenceStep = 1.0 / 1024;  // of a step, for differences

struct RestingContactForce {
  Vec3 acceleration{0, 0, 0};  // m/s^2, of the particle on its surfaces
  Vec3 push{0, 0, 0};          // m/s^2 of it, that of the surfaces along their normals
  Vec3 slip{0, 0, 0};          // m/s, along the first of them
  bool sticks = false;         // friction holds it, and ends a slip that is left
  double surplus = 0;          // m/s^2, by which the free one presses most; < 0: it leads off all
  double squeeze = 0;          // m/s^2, by which surfaces approach each other faster than it can
};

// A particle at x with the velocity v and the free acceleration `free`: normal forces are >= 0 and
// keep it out of all surfaces, gap'' >= 0; the friction of the first acts against the slip, or
// sticks. Derivatives of normals are differences over the time d, which may be negative.
RestingContactForce resting_contact(std::span<const SupportSurface> surfaces, double t, double d,
                                    const Vec3& x, const Vec3& v, const Vec3& free);

}  // namespace sim
