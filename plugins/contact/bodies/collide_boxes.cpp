#include "collide_boxes.h"

#include <algorithm>
#include <cmath>

#include "clip_polygon.h"

namespace sim {
namespace {

struct TurnedBox {
  explicit TurnedBox(const Placed& placed) : center(placed.center), half(placed.shape->half) {
    for (std::size_t k = 0; k < 3; ++k) axis[k] = placed.axes.column(k);
  }
  double reach(const Vec3& n) const {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += half[k] * std::fabs(n.dot(axis[k]));
    return sum;
  }
  // The support point: the corner farthest along n.
  Vec3 support(const Vec3& n) const {
    Vec3 x = center;
    for (std::size_t k = 0; k < 3; ++k) x += std::copysign(half[k], n.dot(axis[k])) * axis[k];
    return x;
  }

  Vec3 center, half, axis[3];
};

constexpr double kOnEdge = 1e-7;  // a corner above an edge is above the face

// The incident face of `other`, most opposed to n, clipped to the sides of the reference face of
// `own` along axis k with normal n.
void add_face(const TurnedBox& own, std::size_t k, const Vec3& n, const TurnedBox& other,
              double margin, double flip, int base, std::vector<ManifoldPoint>& out) {
  std::size_t most = 0;
  for (std::size_t l = 1; l < 3; ++l)
    if (std::fabs(n.dot(other.axis[l])) > std::fabs(n.dot(other.axis[most]))) most = l;
  const Vec3 face = std::copysign(1.0, -n.dot(other.axis[most])) * other.axis[most];
  const std::size_t p = (most + 1) % 3, q = (most + 2) % 3;
  const Vec3 middle = other.center + other.half[most] * face, u = other.half[p] * other.axis[p],
             v = other.half[q] * other.axis[q];
  ClippedPolygon<16> polygon;
  polygon.add(middle - u - v, 0);
  polygon.add(middle + u - v, 1);
  polygon.add(middle + u + v, 2);
  polygon.add(middle - u + v, 3);
  for (int side = 0; side < 4; ++side) {
    const std::size_t l = (k + 1 + static_cast<std::size_t>(side) / 2) % 3;
    const Vec3 out_of = side % 2 ? own.axis[l] : Vec3(-own.axis[l]);
    polygon = polygon.clip(out_of, out_of.dot(own.center) + (1 + kOnEdge) * own.half[l], side);
  }
  const double level = n.dot(own.center) + own.half[k];
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const double gap = n.dot(polygon.x[i]) - level;
    if (gap <= margin)
      out.push_back({polygon.x[i] - 0.5 * gap * n, flip * n, gap, base + polygon.feature[i]});
  }
}

// The contact of two crossing edges at their nearest points.
void add_edges(const TurnedBox& a, const TurnedBox& b, const Vec3& n, std::size_t i, std::size_t j,
               double gap, int feature, std::vector<ManifoldPoint>& out) {
  // n points from b to a.
  Vec3 p = a.support(-n), q = b.support(n);
  p -= a.axis[i].dot(p - a.center) * a.axis[i];
  q -= b.axis[j].dot(q - b.center) * b.axis[j];
  const Vec3 &u = a.axis[i], &v = b.axis[j], d = p - q;
  const double uv = u.dot(v), rest = 1 - uv * uv;
  // Clamped to the edges, which may be nearly parallel.
  const auto within = [](double at, double half) { return std::clamp(at, -half, half); };
  const double s = within((uv * v.dot(d) - u.dot(d)) / rest, a.half[i]);
  const double t = within((v.dot(d) - uv * u.dot(d)) / rest, b.half[j]);
  const Vec3 x = p + s * u, y = q + t * v;
  out.push_back({0.5 * (x + y), n, gap, feature});
}

// Two parallel edges of the boxes at one place, where neither is above a face of the other: there
// the normals of both faces, and all between them, separate the boxes. The mean is used, so that
// what is symmetric stays so: n is along the sum of b's normals at its edge less that of a's. False
// if no edges meet like this.
bool add_parallel_edges(const TurnedBox& a, std::size_t i, const TurnedBox& b, std::size_t j,
                        double near, double margin, int base, std::vector<ManifoldPoint>& out) {
  struct Edge {
    Edge(const TurnedBox& box, std::size_t k, int corner) : middle(box.center) {
      for (std::size_t side = 0; side < 2; ++side) {
        const std::size_t l = (k + 1 + side) % 3;
        face[side] = (corner >> side) % 2 ? box.axis[l] : Vec3(-box.axis[l]);
        middle += box.half[l] * face[side];
      }
    }
    Vec3 middle, face[2];
  };
  const Vec3 &u = a.axis[i], v = std::copysign(1.0, u.dot(b.axis[j])) * b.axis[j];
  for (int k = 0; k < 16; ++k) {
    const Edge one(a, i, k / 4), two(b, j, k % 4);
    const Vec3 d = one.middle - two.middle,
               n = two.face[0] + two.face[1] - one.face[0] - one.face[1];
    const double along = u.dot(d), size = n.norm();
    if ((d - along * u).norm() > near || !(size > 1)) continue;
    bool meets = true;
    for (const Vec3& f : one.face)
      for (const Vec3& g : two.face)
        meets = meets && f.dot(g) > -kNearlyParallel && n.dot(f) < 0 && n.dot(g) > 0;
    const double low = std::max(-a.half[i], -along - b.half[j]),
                 high = std::min(a.half[i], b.half[j] - along);
    if (!meets || !(high > low + near)) continue;
    for (const double s : {low, high}) {
      const Vec3 x = one.middle + s * u, y = two.middle + (s + along) * v;
      const double gap = n.dot(x - y) / size;
      if (gap <= margin)
        out.push_back({0.5 * (x + y), n / size, gap, base + 10 * k + (s == high ? 1 : 0)});
    }
    return true;
  }
  return false;
}

}  // namespace

void collide_boxes(const Placed& first, const Placed& second, double margin,
                   std::vector<ManifoldPoint>& out) {
  constexpr double kParallel = 1e-3;  // sine of edges whose product is no axis
  constexpr double kPrefer = 1e-7;    // of the size: faces before edges
  // The same, faces of the first before those of the second. Boxes that lie on each other turn by
  // a few tolerances in each step, which would give their contact points other names.
  constexpr double kPreferFirst = 3e-5;
  constexpr double kMeet = 1e-3;  // of the size: parallel edges that are at one place
  const TurnedBox a(first), b(second);
  const Vec3 d = a.center - b.center;
  const double size = a.half.maxCoeff() + b.half.maxCoeff(),
               prefers[] = {0, kPreferFirst * size, kPrefer * size};

  // The axis n of largest separation, which points from b to a.
  struct Best {
    double gap = -HUGE_VAL;
    Vec3 n;
    int kind = 0;  // 0: a face of a, 1: of b, 2: edges
    std::size_t i = 0, j = 0;
  } best;
  Vec3 face;  // the best axis of faces
  const auto look = [&](const Vec3& axis, int kind, std::size_t i, std::size_t j) {
    const double along = axis.dot(d);
    const double gap = std::fabs(along) - a.reach(axis) - b.reach(axis);
    const bool nearly_face = kind == 2 && std::fabs(axis.dot(face)) > kNearlyParallel;
    if (gap > best.gap + prefers[kind] && !nearly_face)
      best = {gap, along < 0 ? Vec3(-axis) : axis, kind, i, j};
    return gap <= margin;
  };
  for (std::size_t k = 0; k < 3; ++k)
    if (!look(a.axis[k], 0, k, 0)) return;
  for (std::size_t k = 0; k < 3; ++k)
    if (!look(b.axis[k], 1, k, 0)) return;
  face = best.n;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const Vec3 product = a.axis[i].cross(b.axis[j]);
      const double length = product.norm();
      if (length > kParallel && !look(product / length, 2, i, j)) return;
    }

  const double near = kMeet * size;
  if (best.kind < 2 && best.gap > -near)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        if (a.axis[i].cross(b.axis[j]).norm() <= kParallel &&
            add_parallel_edges(a, i, b, j, near, margin, 1000 * (30 + static_cast<int>(3 * i + j)),
                               out))
          return;

  const int base = 1000 * (10 * best.kind + static_cast<int>(3 * best.i + best.j));
  if (best.kind == 0)
    add_face(a, best.i, -best.n, b, margin, -1, base, out);
  else if (best.kind == 1)
    add_face(b, best.i, best.n, a, margin, 1, base, out);
  else
    add_edges(a, b, best.n, best.i, best.j, best.gap, base, out);
}

}  // namespace sim
