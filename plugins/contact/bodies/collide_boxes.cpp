#include "collide_boxes.h"

#include <algorithm>
#include <cmath>

#include "clip_polygon.h"

namespace sim {
namespace {

constexpr double kParallelEdges = 1e-3;  // sine of edges whose product is no axis
constexpr double kPreferFaces = 1e-7;    // of the size: faces before edges
// The same, faces of the first before those of the second. Boxes that lie on each other turn by
// a few tolerances in each step, which would give their contact points other names.
constexpr double kPreferFirst = 3e-5;
constexpr double kMeet = 1e-3;    // of the size: parallel edges that are at one place
constexpr double kOnEdge = 1e-7;  // a corner above an edge is above the face

struct TurnedBox {
  explicit TurnedBox(const Placed& placed) : center(placed.center), half(placed.shape->half) {
    for (std::size_t k = 0; k < 3; ++k) axis[k] = placed.axes.column(k);
  }
  // The support point: the corner farthest along n.
  Vec3 support(const Vec3& n) const {
    Vec3 x = center;
    for (std::size_t k = 0; k < 3; ++k) x += std::copysign(half[k], n.dot(axis[k])) * axis[k];
    return x;
  }

  Vec3 center, half, axis[3];
};

// The axis n of largest separation of two boxes, from b to a: a normal of a face, or the product of
// an edge of each (Gottschalk, Lin & Manocha (1996), OBBTree, section 5). The separation is that of
// the centers along n less the reaches of both boxes, all from the cosines between their axes.
struct SeparatingAxis {
  enum Kind { kFaceOfFirst, kFaceOfSecond, kEdges };

  // size: of the boxes, m. Looks no further once boxes are farther apart than the margin.
  SeparatingAxis(const TurnedBox& a, const TurnedBox& b, double size, double margin);

  // The sine of the angle between the edges i of a and j of b.
  double sine(std::size_t i, std::size_t j) const {
    const double p = cosine(next(i), j), q = cosine(next(next(i)), j);
    return std::sqrt(p * p + q * q);
  }

  double gap = -HUGE_VAL;  // m
  Vec3 n;
  Kind kind = kFaceOfFirst;
  std::size_t i = 0, j = 0;  // the axis of a face; or the edges of a and b
  Mat3 cosine;               // between axes of a and b

 private:
  static std::size_t next(std::size_t k) { return (k + 1) % 3; }
};

SeparatingAxis::SeparatingAxis(const TurnedBox& a, const TurnedBox& b, double size, double margin) {
  const Vec3 d = a.center - b.center;
  Vec3 along_a, along_b;
  for (std::size_t k = 0; k < 3; ++k) {
    along_a[k] = a.axis[k].dot(d), along_b[k] = b.axis[k].dot(d);
    for (std::size_t l = 0; l < 3; ++l) cosine(k, l) = a.axis[k].dot(b.axis[l]);
  }
  Mat3 size_of;  // of cosines
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t l = 0; l < 3; ++l) size_of(k, l) = std::fabs(cosine(k, l));

  const auto take = [&](double separation, double along, const Vec3& axis, Kind of, std::size_t k,
                        std::size_t l) {
    gap = separation, n = along < 0 ? Vec3(-axis) : axis, kind = of, i = k, j = l;
  };
  const auto apart = [&](double separation) {
    if (separation <= margin) return false;
    gap = separation;
    return true;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const double reach = a.half[k] + b.half.dot(size_of.row(k));
    const double separation = std::fabs(along_a[k]) - reach;
    if (separation > gap) take(separation, along_a[k], a.axis[k], kFaceOfFirst, k, 0);
    if (apart(separation)) return;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const double reach = b.half[k] + a.half.dot(size_of.column(k));
    const double separation = std::fabs(along_b[k]) - reach;
    if (separation > gap + kPreferFirst * size)
      take(separation, along_b[k], b.axis[k], kFaceOfSecond, k, 0);
    if (apart(separation)) return;
  }
  const Vec3 face = n;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t l = 0; l < 3; ++l) {
      const double length = sine(k, l);
      if (!(length > kParallelEdges)) continue;
      // The product of the edges is (-q, p) in the plane of a's other axes.
      const std::size_t k1 = next(k), k2 = next(k1), l1 = next(l), l2 = next(l1);
      const double p = cosine(k1, l), q = cosine(k2, l);
      const double along = along_a[k2] * p - along_a[k1] * q;
      const double reach = a.half[k1] * size_of(k2, l) + a.half[k2] * size_of(k1, l) +
                           b.half[l1] * size_of(k, l2) + b.half[l2] * size_of(k, l1);
      const double separation = (std::fabs(along) - reach) / length;
      if (separation > gap + kPreferFaces * size) {
        const Vec3 axis = (p / length) * a.axis[k2] - (q / length) * a.axis[k1];
        if (!(std::fabs(axis.dot(face)) > kNearlyParallel))
          take(separation, along, axis, kEdges, k, l);
      }
      if (apart(separation)) return;
    }
}

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
  ClippedPolygon<8> polygon;
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
  const Edge of_a[] = {{a, i, 0}, {a, i, 1}, {a, i, 2}, {a, i, 3}},
             of_b[] = {{b, j, 0}, {b, j, 1}, {b, j, 2}, {b, j, 3}};
  for (int k = 0; k < 16; ++k) {
    const Edge &one = of_a[k / 4], &two = of_b[k % 4];
    const Vec3 d = one.middle - two.middle;
    const double along = u.dot(d);
    if ((d - along * u).squaredNorm() > near * near) continue;
    const Vec3 n = two.face[0] + two.face[1] - one.face[0] - one.face[1];
    const double size = n.norm();
    bool meets = size > 1;
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
  const TurnedBox a(first), b(second);
  const double size = a.half.maxCoeff() + b.half.maxCoeff(), near = kMeet * size;
  const SeparatingAxis best(a, b, size, margin);
  if (!(best.gap <= margin)) return;

  if (best.kind != SeparatingAxis::kEdges && best.gap > -near)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        if (best.sine(i, j) <= kParallelEdges &&
            add_parallel_edges(a, i, b, j, near, margin, 1000 * (30 + static_cast<int>(3 * i + j)),
                               out))
          return;

  const int base = 1000 * (10 * best.kind + static_cast<int>(3 * best.i + best.j));
  if (best.kind == SeparatingAxis::kFaceOfFirst)
    add_face(a, best.i, -best.n, b, margin, -1, base, out);
  else if (best.kind == SeparatingAxis::kFaceOfSecond)
    add_face(b, best.i, best.n, a, margin, 1, base, out);
  else
    add_edges(a, b, best.n, best.i, best.j, best.gap, base, out);
}

}  // namespace sim
