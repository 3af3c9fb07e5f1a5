#include "collide.h"

#include <algorithm>
#include <cmath>

#include "collide_boxes.h"
#include "hull.h"

namespace sim {
namespace {

using Form = RigidShape::Form;

// Half of the axis of a capsule; 0 for a sphere.
Vec3 half_axis(const Placed& a) { return 0.5 * a.shape->length * a.axes.column(1); }

// The gap of a sphere or capsule: the distance from the axis, less the radius.
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

// The part of a segment center + s half that is above the face with normal n of a box or hull, or
// beside a capsule.
struct AxisPart {
  double from = 1, to = -1;  // empty

  void cut(double at_0, double rate, double most) {  // at_0 + rate s <= most
    if (rate > 0) to = std::min(to, (most - at_0) / rate);
    if (rate < 0) from = std::max(from, (most - at_0) / rate);
    if (rate == 0 && at_0 > most) to = from - 1;
  }
};

constexpr double kFace = 1 - 1e-12;  // cosine: it is the normal of the face

AxisPart above_face(const Placed& b, const Vec3& normal, const Vec3& center, const Vec3& half) {
  const Vec3 n = transposed(b.axes) * normal, x = transposed(b.axes) * (center - b.center),
             d = transposed(b.axes) * half;
  AxisPart part;
  if (b.shape->form == Form::kCapsule) {
    // Two capsules side by side.
    const double most = 0.5 * b.shape->length, length = d.norm();
    if (std::fabs(n[1]) > std::sqrt(1 - kNearlyParallel) ||
        std::fabs(d[1]) < kNearlyParallel * length)
      return part;
    part = {-1, 1};
    part.cut(x[1], d[1], most);
    part.cut(-x[1], -d[1], most);
  } else if (b.shape->form == Form::kBox) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(std::fabs(n[k]) > kFace)) continue;
      part = {-1, 1};
      for (const std::size_t l : {(k + 1) % 3, (k + 2) % 3}) {
        part.cut(x[l], d[l], b.shape->half[l]);
        part.cut(-x[l], -d[l], b.shape->half[l]);
      }
    }
  } else if (b.hull) {
    for (const Hull::Face& face : b.hull->faces) {
      if (!(face.normal.dot(n) > kFace)) continue;
      part = {-1, 1};
      const auto corner = [&](int k) {
        return b.hull->points[static_cast<std::size_t>(
            b.hull->corners[static_cast<std::size_t>(k < face.end ? k : face.begin)])];
      };
      for (int k = face.begin; k < face.end; ++k) {
        const Vec3 side = (corner(k + 1) - corner(k)).cross(face.normal);
        part.cut(side.dot(x), side.dot(d), side.dot(corner(k)));
      }
    }
  }
  return part;
}

// Contact of a sphere or capsule a with a shape whose gap is convex along a line: at both ends of
// the axis; and at the nearest point in between, or at both ends of the part above a face.
// nearest_at(half): where on the axis, from -1 to 1.
template <class GapAt, class NearestAt, class FaceAt>
void touch_round(const Placed& a, double margin, const GapAt& gap_at, const NearestAt& nearest_at,
                 const FaceAt& above, std::vector<ManifoldPoint>& out) {
  const double radius = a.shape->radius;
  const auto add = [&](const Vec3& x, const NearestGap& gap, int feature) {
    const double free = gap.gap - radius;
    if (free <= margin)
      out.push_back({x - (radius + 0.5 * free) * gap.normal, gap.normal, free, feature});
  };
  if (a.shape->form == Form::kSphere) return add(a.center, gap_at(a.center), 0);
  const Vec3 half = half_axis(a);
  const NearestGap low = gap_at(a.center - half), high = gap_at(a.center + half);
  // The gap changes by no more than the way along the axis.
  if (0.5 * (low.gap + high.gap) - half.norm() - radius > margin) return;
  add(a.center - half, low, 0);
  add(a.center + half, high, 1);
  const double between = nearest_at(half);
  const NearestGap nearest = gap_at(a.center + between * half);
  constexpr double kEnd = 1 - 1e-3;  // nearly an end is an end
  const AxisPart part = above(nearest.normal, a.center, half);
  if (part.to - part.from > 1 - kEnd) {
    for (const double s : {part.from, part.to})
      if (std::fabs(s) < kEnd) {
        const Vec3 x = a.center + s * half;
        add(x, gap_at(x), s == part.from ? 3 : 4);
      }
  } else if (std::fabs(between) < kEnd &&
             nearest.gap < std::min(low.gap, high.gap) - 1e-12 * radius) {
    add(a.center + between * half, nearest, 2);
  }
}

// The minimum of a gap along an axis, by bisection: its derivative n.half increases.
template <class GapAt>
double nearest_by_bisection(const Vec3& center, const Vec3& half, const GapAt& gap_at) {
  double from = -1, to = 1;
  for (int turn = 0; turn < 60 && to - from > 1e-16; ++turn) {
    const double s = 0.5 * (from + to);
    (gap_at(center + s * half).normal.dot(half) > 0 ? to : from) = s;
  }
  return 0.5 * (from + to);
}

// The same to another axis, in closed form (Ericson (2005), Real-Time Collision Detection, section
// 5.1.9).
double nearest_to_axis(const Vec3& center, const Vec3& half, const Placed& b) {
  const auto clamped = [](double s) { return std::clamp(s, -1.0, 1.0); };
  const Vec3 other = half_axis(b), d = center - b.center;
  const double uu = half.squaredNorm(), vv = other.squaredNorm(), uv = half.dot(other),
               ud = half.dot(d), vd = other.dot(d), crossed = uu * vv - uv * uv;
  if (!(vv > 0)) return clamped(-ud / uu);
  const double s = crossed > 0 ? clamped((uv * vd - ud * vv) / crossed) : 0.0;
  return clamped((uv * clamped((uv * s + vd) / vv) - ud) / uu);
}

// The same for a placed shape.
void touch_round(const Placed& a, const Placed& b, double margin, std::vector<ManifoldPoint>& out) {
  const auto gap_at = [&](const Vec3& x) { return gap_from(b, x); };
  touch_round(
      a, margin, gap_at,
      [&](const Vec3& half) {
        return b.shape->is_round() ? nearest_to_axis(a.center, half, b)
                                   : nearest_by_bisection(a.center, half, gap_at);
      },
      [&](const Vec3& n, const Vec3& center, const Vec3& half) {
        return above_face(b, n, center, half);
      },
      out);
}

}  // namespace

bool can_collide(const Placed& a) { return a.shape->form != Form::kMesh || a.hull; }

NearestGap gap_from(const Placed& b, const Vec3& x) {
  if (b.shape->is_round()) return gap_from_round(b, x);
  return b.shape->form == Form::kBox ? gap_from_box(b, x) : gap_from_hull(b, x);
}

void collide(const Placed& a, const Placed& b, double margin, std::vector<ManifoldPoint>& out) {
  if (a.shape->is_round()) return touch_round(a, b, margin, out);
  if (!b.shape->is_round()) {
    const bool boxes = a.shape->form == Form::kBox && b.shape->form == Form::kBox;
    return boxes ? collide_boxes(a, b, margin, out) : collide_hulls(a, b, margin, out);
  }
  const std::size_t first = out.size();
  touch_round(b, a, margin, out);
  for (std::size_t k = first; k < out.size(); ++k) out[k].normal = -out[k].normal;
}

void collide(const Placed& a, const Collider& b, double t, double margin,
             std::vector<ManifoldPoint>& out) {
  const auto gap_at = [&](const Vec3& x) {
    const SurfaceSample sample = b.query(t, x);
    return NearestGap{sample.gap, sample.normal};
  };
  if (a.shape->is_round())
    return touch_round(
        a, margin, gap_at,
        [&](const Vec3& half) { return nearest_by_bisection(a.center, half, gap_at); },
        [](const Vec3&, const Vec3&, const Vec3&) { return AxisPart(); }, out);
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
