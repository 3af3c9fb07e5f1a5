#include "core/particles/resting_contact.h"

#include <algorithm>
#include <cmath>

#include "core/particles/contacts.h"
#include "core/particles/velocity_inequality.h"

namespace sim {

RestingContactForce resting_contact(std::span<const SupportSurface> surfaces, double t, double d,
                                    const Vec3& x, const Vec3& v, const Vec3& free) {
  // gap'' = n.a + (n.(v - u))' along the straight path, from a difference quotient of three values.
  VelocityInequality bound;
  RestingContactForce pressed{.surplus = -HUGE_VAL};
  for (const SupportSurface& held : surfaces) {
    if (bound.count == VelocityInequality::kMost) break;
    const auto rate = [&](double after) {
      const SurfaceSample sample = held.query(t + after, x + after * v);
      return sample.normal.dot(v - sample.velocity);
    };
    const double curving = (4 * rate(d) - rate(2 * d) - 3 * rate(0)) / (2 * d);
    const Vec3 normal = held.query(t, x).normal;
    bound.planes[bound.count++] = {normal, -curving};
    pressed.surplus = std::max(pressed.surplus, -curving - normal.dot(free));
  }
  const NearestPoint nearest =
      nearest_point(bound.planes, bound.count, (1u << bound.count) - 1, free);
  pressed.acceleration = nearest.point;
  pressed.squeeze = nearest.miss;
  pressed.push = pressed.acceleration - free;
  if (bound.count == 0) return pressed;

  const Collider& surface = *surfaces[0].collider;
  const SurfaceSample sample = surfaces[0].query(t, x);
  const Vec3 relative = v - sample.velocity;
  pressed.slip = tangential(relative, sample.normal);
  const ContactMaterial material = surface.material();
  const double push = pressed.push.norm(), friction = material.friction * push;
  if (friction == 0) return pressed;
  const double speed = pressed.slip.norm(), size = pressed.acceleration.norm();
  // A slip that friction ends within the rounding of positions counts as none.
  const double faint = 0.5 * speed * speed / Contacts::slack(x);  // the least braking, m/s^2
  const bool none =
      speed <= 1e-12 * (v.norm() + sample.velocity.norm()) + 1e-6 * std::fabs(d) * size;
  const auto slide = [&](const Vec3& against) {
    pressed.acceleration -= material.friction_at(speed) * push / against.norm() * against;
    return pressed;
  };
  const double step = std::fabs(d) / kDifferenceStep;
  const bool slow = speed < friction * step;  // friction could stop it within the step
  if (!none && faint >= friction && !slow) return slide(pressed.slip);
  const Vec3 carried =
      (surface.query(t + d, surface.advect(t, t + d, x)).velocity - sample.velocity) / d;
  const Vec3 drive = pressed.acceleration - carried;
  const double driven = drive.norm();
  if (driven <= friction && (none || faint < friction - driven)) {
    pressed.acceleration = carried;
    pressed.sticks = true;
    return pressed;
  }
  if (!none) {
    // A slow slip turns towards what drives it faster than a step can follow, so that friction acts
    // against the slip at a later time within the step, which is the present one for fast slips.
    const double along = pressed.slip.dot(drive);
    if (!slow || along <= 0) return slide(pressed.slip);
    const double later = (step - speed / friction) * along / (speed * driven);
    return slide(pressed.slip + later * drive);
  }
  const double slides = std::min(driven, material.friction_at(std::fabs(d) * driven) * push);
  pressed.acceleration = pressed.acceleration - slides / driven * drive;
  return pressed;
}

}  // namespace sim
