#include "collider_shape.h"

#include <algorithm>
#include <cmath>

#include "collide.h"
#include "core/math/elementary.h"

namespace sim {
namespace {

// A capsule's own axis is y, in a drawing the first one.
Mat3 axes_of(const RenderShape& drawn) {
  const auto unit = [&](std::size_t k) { return Vec3(drawn.axes[k] / drawn.axes[k].norm()); };
  if (drawn.form == RenderShape::Form::kCapsule) return transposed({unit(2), unit(0), unit(1)});
  return transposed({unit(0), unit(1), unit(2)});
}

std::optional<RigidShape> shape_of(const RenderShape& drawn) {
  if (drawn.inside) return {};
  const auto length = [&](std::size_t k) { return drawn.axes[k].norm(); };
  RigidShape shape;
  shape.radius = drawn.radius;
  switch (drawn.form) {
    case RenderShape::Form::kSphere:
      return shape;
    case RenderShape::Form::kCapsule:
      shape.form = RigidShape::Form::kCapsule;
      shape.length = 2 * length(0);
      return shape;
    case RenderShape::Form::kBox:
      shape.form = RigidShape::Form::kBox;
      shape.half = {length(0), length(1), length(2)};
      return shape;
    default:
      return {};
  }
}

}  // namespace

std::optional<ColliderShape> ColliderShape::of(const Collider& collider) {
  const RenderShape drawn = collider.shape(0);
  const std::optional<RigidShape> shape = shape_of(drawn);
  if (!shape) return {};
  ColliderShape found;
  found.shape_ = *shape;
  found.hull_ = hull_of(*shape);
  const Placed placed = found.at(collider, 0);

  // Samples from near to far, in directions without a pattern.
  constexpr int kLooks = 60;
  constexpr double kSame = 1e-9;
  const double size = shape->radius + shape->length + shape->half.norm();
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (int k = 0; k < kLooks; ++k) {
    const Vec3 way(elementary::sin(1.0 + 3 * k), elementary::sin(2.0 + 5 * k),
                   elementary::sin(3.0 + 7 * k));
    const Vec3 x = placed.center + (1.5 + 0.1 * k) * size / way.norm() * way;
    const double differs = gap_from(placed, x).gap - collider.query(0, x).gap;
    least = std::min(least, differs), most = std::max(most, differs);
  }
  if (!(most - least <= kSame * size)) return {};
  found.thickness_ = 0.5 * (least + most);
  return found;
}

Placed ColliderShape::at(const Collider& collider, double t) const {
  const RenderShape drawn = collider.shape(t);
  return {&shape_, hull_ ? &*hull_ : nullptr, drawn.center, axes_of(drawn)};
}

}  // namespace sim
