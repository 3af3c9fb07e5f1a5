#include "collide_hulls.h"

#include <algorithm>
#include <cmath>

#include "clip_polygon.h"
#include "hull.h"

namespace sim {
namespace {

constexpr double kParallel = 1e-3;  // sine of edges whose product is no axis
constexpr double kPrefer = 1e-7;    // of a size: faces before edges, the first before the second

// A hull in the frame of another one.
class Seen {
 public:
  Seen(const Placed& hull, const Placed& from)
      : hull_(hull.hull),
        turn_(transposed(from.axes) * hull.axes),
        shift_(transposed(from.axes) * (hull.center - from.center)) {}

  Vec3 point(int i) const { return shift_ + turn_ * hull_->points[static_cast<std::size_t>(i)]; }
  Vec3 direction(const Vec3& d) const { return turn_ * d; }
  Vec3 farthest(const Vec3& d) const {
    return shift_ + turn_ * hull_->farthest(transposed(turn_) * d);
  }
  const Hull& hull() const { return *hull_; }

 private:
  const Hull* hull_;
  Mat3 turn_;
  Vec3 shift_;
};

struct BestAxis {
  enum class Kind { kFirst, kSecond, kEdges };

  double gap = -HUGE_VAL;
  Kind kind = Kind::kFirst;
  std::size_t i = 0, j = 0;
  Vec3 normal;  // of edges: from the first to the second, in the frame of the first

  void look(double found, double by, Kind of, std::size_t a, std::size_t b, const Vec3& n) {
    if (found > gap + by) *this = {found, of, a, b, n};
  }
};

// Tests the face normals of `own` as separating axes.
bool look_at_faces(const Hull& own, const Seen& other, double margin, double by,
                   BestAxis::Kind kind, BestAxis& best) {
  for (std::size_t f = 0; f < own.faces.size(); ++f) {
    const Hull::Face& face = own.faces[f];
    const double gap = face.normal.dot(other.farthest(-face.normal)) - face.level;
    best.look(gap, by, kind, f, 0, face.normal);
    if (gap > margin) return false;
  }
  return true;
}

// Tests edge pairs; an axis nearly parallel to the best face normal is skipped in its favour.
bool look_at_edges(const Hull& own, const Seen& other, double margin, double by, BestAxis& best) {
  const Vec3 face =
      best.kind == BestAxis::Kind::kSecond ? other.direction(best.normal) : best.normal;
  for (std::size_t j = 0; j < other.hull().edges.size(); ++j) {
    const Hull::Edge& far = other.hull().edges[j];
    const Vec3 at = other.point(far.a), way = other.point(far.b) - at;
    const Vec3 c = -other.direction(far.left), d = -other.direction(far.right);
    const Vec3 arc = d.cross(c);
    for (std::size_t i = 0; i < own.edges.size(); ++i) {
      const Hull::Edge& near = own.edges[i];
      const Vec3 across = near.right.cross(near.left);
      const double one = c.dot(across), two = d.dot(across), three = near.left.dot(arc),
                   four = near.right.dot(arc);
      if (!(one * two < 0 && three * four < 0 && one * four > 0)) continue;
      const Vec3& start = own.points[static_cast<std::size_t>(near.a)];
      const Vec3 along = own.points[static_cast<std::size_t>(near.b)] - start;
      Vec3 n = along.cross(way);
      const double length = n.norm();
      if (!(length > kParallel * along.norm() * way.norm())) continue;
      n *= (n.dot(start - own.middle) < 0 ? -1 : 1) / length;
      const double gap = n.dot(at - start);
      if (std::fabs(n.dot(face)) <= kNearlyParallel)
        best.look(gap, by, BestAxis::Kind::kEdges, i, j, n);
      if (gap > margin) return false;
    }
  }
  return true;
}

// The incident face of `other`, most opposed to that of `own`, clipped to its sides.
void add_face(const Placed& own, const Hull::Face& face, const Placed& other, double margin,
              double flip, int base, std::vector<ManifoldPoint>& out) {
  const Vec3 n = own.axes * face.normal, n_there = transposed(other.axes) * n;
  const auto& faces = other.hull->faces;
  const auto against = std::ranges::min_element(
      faces, {}, [&](const Hull::Face& each) { return each.normal.dot(n_there); });
  ClippedPolygon<2 * Hull::kMostCorners> polygon;
  for (int k = against->begin; k < against->end; ++k) {
    const int corner = other.hull->corners[static_cast<std::size_t>(k)];
    polygon.add(other.center + other.axes * other.hull->points[static_cast<std::size_t>(corner)],
                corner);
  }
  const auto corner_of_own = [&](int k) {
    const auto corner = own.hull->corners[static_cast<std::size_t>(k)];
    return Vec3(own.center + own.axes * own.hull->points[static_cast<std::size_t>(corner)]);
  };
  constexpr double kAtEdge = 1e-7;  // of an edge: a corner above it is above the face
  for (int k = face.begin; k < face.end; ++k) {
    const Vec3 from = corner_of_own(k), to = corner_of_own(k + 1 < face.end ? k + 1 : face.begin),
               along = to - from;
    const Vec3 side = along.cross(n) / along.norm();
    polygon = polygon.clip(side, side.dot(from) + kAtEdge * along.norm(), k - face.begin + 1);
  }
  const double level = n.dot(own.center) + face.level;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const double gap = n.dot(polygon.x[i]) - level;
    if (gap <= margin)
      out.push_back({polygon.x[i] - 0.5 * gap * n, flip * n, gap, base + polygon.feature[i]});
  }
}

// The contact of two edges at their nearest points; n points from b to a.
void add_edges(const Placed& a, const Placed& b, const BestAxis& best, int base,
               std::vector<ManifoldPoint>& out) {
  const auto ends = [](const Placed& of, std::size_t edge) {
    const Hull::Edge& e = of.hull->edges[edge];
    const auto at = [&](int i) {
      return Vec3(of.center + of.axes * of.hull->points[static_cast<std::size_t>(i)]);
    };
    return std::pair(at(e.a), at(e.b));
  };
  const auto [p, p_end] = ends(a, best.i);
  const auto [q, q_end] = ends(b, best.j);
  const Vec3 u = p_end - p, v = q_end - q, d = p - q;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), rest = uu * vv - uv * uv;
  const double s = std::clamp((uv * v.dot(d) - vv * u.dot(d)) / rest, 0.0, 1.0);
  const double t = std::clamp((uu * v.dot(d) - uv * u.dot(d)) / rest, 0.0, 1.0);
  out.push_back({0.5 * (p + s * u + q + t * v), -(a.axes * best.normal), best.gap, base});
}

// The nearest point of a triangle, by the Voronoi region of x (Ericson (2005), Real-Time Collision
// Detection, section 5.1.5).
Vec3 nearest_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ax = x - a, bx = x - b, cx = x - c;
  const double d1 = ab.dot(ax), d2 = ac.dot(ax), d3 = ab.dot(bx), d4 = ac.dot(bx), d5 = ab.dot(cx),
               d6 = ac.dot(cx);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const double of_c = d1 * d4 - d3 * d2, of_b = d5 * d2 - d1 * d6, of_a = d3 * d6 - d5 * d4;
  if (of_c <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  if (of_b <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  if (of_a <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const double sum = of_a + of_b + of_c;
  return a + of_b / sum * ab + of_c / sum * ac;
}

}  // namespace

void collide_hulls(const Placed& a, const Placed& b, double margin,
                   std::vector<ManifoldPoint>& out) {
  const Seen second(b, a), first(a, b);
  double size = 0;
  for (const Hull* hull : {a.hull, b.hull}) size += (hull->points.front() - hull->middle).norm();
  const double by = kPrefer * size;
  BestAxis best;
  if (!look_at_faces(*a.hull, second, margin, 0, BestAxis::Kind::kFirst, best) ||
      !look_at_faces(*b.hull, first, margin, by, BestAxis::Kind::kSecond, best) ||
      !look_at_edges(*a.hull, second, margin, by, best))
    return;

  constexpr int kRoom = 10'000;  // of the corners of a hull
  const int base = kRoom * (3 * static_cast<int>(best.i % 10'000) + static_cast<int>(best.kind));
  if (best.kind == BestAxis::Kind::kFirst)
    add_face(a, a.hull->faces[best.i], b, margin, -1, base, out);
  else if (best.kind == BestAxis::Kind::kSecond)
    add_face(b, b.hull->faces[best.i], a, margin, 1, base, out);
  else
    add_edges(a, b, best, base + static_cast<int>(best.j % kRoom), out);
}

NearestGap gap_from_hull(const Placed& b, const Vec3& x) {
  const Hull& hull = *b.hull;
  const Vec3 local = transposed(b.axes) * (x - b.center);
  double depth = -HUGE_VAL;
  Vec3 normal;
  for (const Hull::Face& face : hull.faces)
    if (const double gap = face.normal.dot(local) - face.level; gap > depth)
      depth = gap, normal = face.normal;
  if (depth > 0) {
    double best = HUGE_VAL;
    const auto corner = [&](int i) { return hull.points[static_cast<std::size_t>(i)]; };
    for (const auto& [i, j, k] : hull.triangles) {
      const Vec3 away = local - nearest_on_triangle(local, corner(i), corner(j), corner(k));
      if (const double gap = away.norm(); gap < best) best = gap, normal = away;
    }
    if (!(best > 0)) return {0, b.axes * hull.faces.front().normal};
    depth = best;
    normal /= best;
  }
  return {depth, b.axes * normal};
}

}  // namespace sim
