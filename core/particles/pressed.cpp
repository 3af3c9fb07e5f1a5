#include "core/particles/pressed.h"

#include <algorithm>
#include <cmath>

#include "core/particles/implicit/bounds.h"

namespace sim {

Pressed pressed_on(std::span<Collider* const> colliders, double t, double d, const Vec3& x,
                   const Vec3& v, const Vec3& free) {
  // gap'' = n.a + (n.(v - u))' along the straight way, by three values.
  Bound bound;
  Pressed pressed{.surplus = -HUGE_VAL};
  for (Collider* const collider : colliders) {
    if (bound.count == Bound::kMost) break;
    const auto rate = [&](double after) {
      const Touch touch = collider->touch(t + after, x + after * v);
      return touch.normal.dot(v - touch.velocity);
    };
    const double curving = (4 * rate(d) - rate(2 * d) - 3 * rate(0)) / (2 * d);
    const Vec3 normal = collider->touch(t, x).normal;
    bound.planes[bound.count++] = {normal, -curving};
    pressed.surplus = std::max(pressed.surplus, -curving - normal.dot(free));
  }
  pressed.acceleration = bound.nearest(free);
  pressed.push = pressed.acceleration - free;
  if (bound.count == 0) return pressed;

  const Collider& surface = *colliders[0];
  const Touch touch = surface.touch(t, x);
  const Vec3 relative = v - touch.velocity;
  pressed.slip = tangential(relative, touch.normal);
  const Surface material = surface.surface();
  const double push = pressed.push.norm(), friction = material.friction * push;
  if (friction == 0) return pressed;
  const double speed = pressed.slip.norm(), size = pressed.acceleration.norm();
  if (speed > 1e-12 * (v.norm() + touch.velocity.norm()) + 1e-6 * std::fabs(d) * size) {
    pressed.acceleration -= material.friction_at(speed) * push / speed * pressed.slip;
    return pressed;
  }
  const Vec3 carried =
      (surface.touch(t + d, surface.carried(t, t + d, x)).velocity - touch.velocity) / d;
  const Vec3 drive = pressed.acceleration - carried;
  const double driven = drive.norm();
  if (driven <= friction) {
    pressed.acceleration = carried;
    return pressed;
  }
  const double slides = std::min(driven, material.friction_at(std::fabs(d) * driven) * push);
  pressed.acceleration = pressed.acceleration - slides / driven * drive;
  return pressed;
}

}  // namespace sim
