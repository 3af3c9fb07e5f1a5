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

}  // namespace

void collide_boxes(const Placed& first, const Placed& second, double margin,
                   std::vector<ManifoldPoint>& out) {
  constexpr double kParallel = 1e-3;  // sine of edges whose product is no axis
  constexpr double kPrefer = 1e-7;    // of a size: faces before edges, the first before the second
  const TurnedBox a(first), b(second);
  const Vec3 d = a.center - b.center;
  const double prefer = kPrefer * (a.half.maxCoeff() + b.half.maxCoeff());

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
    if (gap > best.gap + (kind > 0 ? prefer : 0) && !nearly_face)
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

  const int base = 1000 * (10 * best.kind + static_cast<int>(3 * best.i + best.j));
  if (best.kind == 0)
    add_face(a, best.i, -best.n, b, margin, -1, base, out);
  else if (best.kind == 1)
    add_face(b, best.i, best.n, a, margin, 1, base, out);
  else
    add_edges(a, b, best.n, best.i, best.j, best.gap, base, out);
}

}  // namespace sim
