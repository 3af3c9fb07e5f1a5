#include "core/particles/rigid/touching.h"

#include <algorithm>
#include <cmath>

#include "core/particles/rigid/touching_boxes.h"

namespace sim {
namespace {

using Form = RigidShape::Form;

struct NearestGap {
  double gap;   // m
  Vec3 normal;  // away from the solid
};

bool is_round(const RigidShape& shape) {
  return shape.form == Form::kSphere || shape.form == Form::kCapsule;
}

// Half of the axis of a capsule; of a sphere 0.
Vec3 half_axis(const Placed& a) { return 0.5 * a.shape->length * a.axes.column(1); }

// From a sphere or capsule: the distance from the axis, less the radius.
NearestGap gap_from_round(const Placed& b, const Vec3& x) {
  const Vec3 half = half_axis(b), d = x - b.center;
  const double square = half.squaredNorm();
  const double s = square > 0 ? std::clamp(d.dot(half) / square, -1.0, 1.0) : 0.0;
  const Vec3 off = d - s * half;
  const double distance = off.norm();
  return {distance - b.shape->radius, distance > 0 ? Vec3(off / distance) : Vec3(0, 1, 0)};
}

NearestGap gap_from_box(const Placed& b, const Vec3& x) {
  const Vec3 d = x - b.center;
  Vec3 local, out;
  std::size_t nearest = 0;
  double depth = -HUGE_VAL;
  for (std::size_t k = 0; k < 3; ++k) {
    local[k] = b.axes.column(k).dot(d);
    const double beyond = std::fabs(local[k]) - b.shape->half[k];
    out[k] = std::max(0.0, beyond);
    if (beyond > depth) depth = beyond, nearest = k;
  }
  const double gap = out.norm();
  if (!(gap > 0)) return {depth, std::copysign(1.0, local[nearest]) * b.axes.column(nearest)};
  Vec3 normal;
  for (std::size_t k = 0; k < 3; ++k)
    normal += std::copysign(out[k] / gap, local[k]) * b.axes.column(k);
  return {gap, normal};
}

NearestGap gap_from(const Placed& b, const Vec3& x) {
  return is_round(*b.shape) ? gap_from_round(b, x) : gap_from_box(b, x);
}

// A sphere or capsule a and a solid whose gap is convex along a line: at both ends of the axis, and
// in between where it is nearer there.
template <class GapAt>
void touch_round(const Placed& a, double margin, const GapAt& gap_at,
                 std::vector<TouchPoint>& out) {
  const double radius = a.shape->radius;
  const auto add = [&](const Vec3& x, const NearestGap& gap, int feature) {
    const double free = gap.gap - radius;
    if (free <= margin)
      out.push_back({x - (radius + 0.5 * free) * gap.normal, gap.normal, free, feature});
  };
  if (a.shape->form == Form::kSphere) return add(a.center, gap_at(a.center), 0);
  const Vec3 half = half_axis(a);
  const NearestGap low = gap_at(a.center - half), high = gap_at(a.center + half);
  add(a.center - half, low, 0);
  add(a.center + half, high, 1);
  // Golden section.
  constexpr double kShare = 0.6180339887498949;
  constexpr int kTurns = 60;
  double from = -1, to = 1;
  double s = to - kShare * (to - from), u = from + kShare * (to - from);
  NearestGap at_s = gap_at(a.center + s * half), at_u = gap_at(a.center + u * half);
  for (int turn = 0; turn < kTurns && to - from > 1e-10; ++turn) {
    if (at_s.gap < at_u.gap) {
      to = u, u = s, at_u = at_s;
      s = to - kShare * (to - from);
      at_s = gap_at(a.center + s * half);
    } else {
      from = s, s = u, at_s = at_u;
      u = from + kShare * (to - from);
      at_u = gap_at(a.center + u * half);
    }
  }
  const double between = 0.5 * (from + to);
  constexpr double kEnd = 1 - 1e-3;  // nearly an end is an end
  if (std::fabs(between) < kEnd &&
      std::min(at_s.gap, at_u.gap) < std::min(low.gap, high.gap) - 1e-12 * radius)
    add(a.center + between * half, gap_at(a.center + between * half), 2);
}

}  // namespace

bool can_touch(const RigidShape& a, const RigidShape& b) {
  return a.form != Form::kMesh && b.form != Form::kMesh;
}

void touching(const Placed& a, const Placed& b, double margin, std::vector<TouchPoint>& out) {
  if (is_round(*a.shape))
    return touch_round(
        a, margin, [&](const Vec3& x) { return gap_from(b, x); }, out);
  if (!is_round(*b.shape)) return touching_boxes(a, b, margin, out);
  const std::size_t first = out.size();
  touch_round(
      b, margin, [&](const Vec3& x) { return gap_from(a, x); }, out);
  for (std::size_t k = first; k < out.size(); ++k) out[k].normal = -out[k].normal;
}

void touching(const Placed& a, const Collider& b, double t, double margin,
              std::vector<TouchPoint>& out) {
  const auto gap_at = [&](const Vec3& x) {
    const Touch touch = b.touch(t, x);
    return NearestGap{touch.gap, touch.normal};
  };
  if (is_round(*a.shape)) return touch_round(a, margin, gap_at, out);
  const auto corner = [&](const Vec3& local, int feature) {
    const Vec3 x = a.center + a.axes * local;
    const NearestGap gap = gap_at(x);
    if (gap.gap <= margin)
      out.push_back({x - 0.5 * gap.gap * gap.normal, gap.normal, gap.gap, feature});
  };
  if (a.shape->form == Form::kBox) {
    const Vec3& h = a.shape->half;
    for (int k = 0; k < 8; ++k)
      corner({k & 1 ? h[0] : -h[0], k & 2 ? h[1] : -h[1], k & 4 ? h[2] : -h[2]}, k);
  } else {
    for (std::size_t k = 0; k < a.shape->points.size(); ++k)
      corner(a.shape->points[k], static_cast<int>(k));
  }
}

}  // namespace sim
