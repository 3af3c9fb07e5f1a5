#include "time_of_impact.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr int kMostAdvances = 400;
// The rounding error of a distance with a wide margin, relative to the largest coordinate or
// displacement.
constexpr double kRounding = 1e-14;

// Calls f(i, j) for the corners of one part and the other.
template <class F>
void each_corners(PairKind kind, const F& f) {
  if (kind == PairKind::kVertexTriangle) {
    f(0, 1), f(0, 2), f(0, 3);
  } else {
    f(0, 2), f(0, 3), f(1, 2), f(1, 3);
  }
}

double clamped(double x) { return std::clamp(x, 0.0, 1.0); }

// The parameter of the point on the segment a + s d nearest to p.
double place_on(const Vec3& a, const Vec3& d, const Vec3& p) {
  const double length = d.squaredNorm();
  return length > 0 ? clamped((p - a).dot(d) / length) : 0.0;
}

class Best {
 public:
  Best(PairKind kind, const FourPoints& p) : kind_(kind), p_(p) { found_.gap = -HUGE_VAL; }

  // Returns true if the bound cannot be improved.
  bool take(const std::array<double, 4>& weights) {
    Vec3 r = Vec3::Zero();
    for (std::size_t k = 0; k < 4; ++k) r += weights[k] * p_[k];
    return take_along(weights, r);
  }
  bool take_along(const std::array<double, 4>& weights, const Vec3& r) {
    const double length = r.stableNorm();
    if (!(length > 0)) return false;
    const Vec3 n = r / length;
    double gap = HUGE_VAL;
    each_corners(kind_,
                 [&](std::size_t i, std::size_t j) { gap = std::min(gap, n.dot(p_[i] - p_[j])); });
    if (gap > found_.gap) found_ = {n, weights, gap};
    return gap > 0.999 * length;
  }
  const Separation& found() const { return found_; }

 private:
  PairKind kind_;
  const FourPoints& p_;
  Separation found_{};
};

// The nearest point of a triangle to the origin: Ericson (2005), Real-Time Collision Detection,
// 5.1.5.
std::array<double, 4> nearest_in_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a;
  const double d1 = -ab.dot(a), d2 = -ac.dot(a);
  if (d1 <= 0 && d2 <= 0) return {1, -1, 0, 0};
  const double d3 = -ab.dot(b), d4 = -ac.dot(b);
  if (d3 >= 0 && d4 <= d3) return {1, 0, -1, 0};
  const double d5 = -ab.dot(c), d6 = -ac.dot(c);
  if (d6 >= 0 && d5 <= d6) return {1, 0, 0, -1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double s = d1 - d3 > 0 ? d1 / (d1 - d3) : 0;
    return {1, s - 1, -s, 0};
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double s = d2 - d6 > 0 ? d2 / (d2 - d6) : 0;
    return {1, s - 1, 0, -s};
  }
  const double va = d3 * d6 - d5 * d4;
  const double along = d4 - d3, across = d5 - d6;
  if (va <= 0 && along >= 0 && across >= 0) {
    const double s = along + across > 0 ? along / (along + across) : 0;
    return {1, 0, s - 1, -s};
  }
  const double all = va + vb + vc;
  const double v = vb / all, w = vc / all;
  return {1, v + w - 1, -v, -w};
}

Separation of_vertex_triangle(const FourPoints& p) {
  Best best(PairKind::kVertexTriangle, p);
  if (best.take(nearest_in_triangle(p[1], p[2], p[3]))) return best.found();
  // A thin triangle is treated by its edges and its plane.
  for (std::size_t k = 1; k < 4; ++k) {
    const std::size_t next = k % 3 + 1;
    std::array<double, 4> weights{1, 0, 0, 0};
    const double s = place_on(p[k], p[next] - p[k], p[0]);
    weights[k] = s - 1;
    weights[next] -= s;
    best.take(weights);
  }
  const Vec3 n = (p[2] - p[1]).cross(p[3] - p[1]);
  const std::array<double, 4> middle{1, -1.0 / 3, -1.0 / 3, -1.0 / 3};
  best.take_along(middle, n.dot(p[0] - p[1]) > 0 ? n : -n);
  return best.found();
}

// The distance of two edges: Ericson (2005), 5.1.9.
Separation of_edges(const FourPoints& p) {
  Best best(PairKind::kEdgeEdge, p);
  const Vec3 d1 = p[1] - p[0], d2 = p[3] - p[2], r = p[0] - p[2];
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r),
               b = d1.dot(d2);
  const double square = a * e - b * b;
  double s = square > 1e-12 * a * e ? clamped((b * f - c * e) / square) : 0.5;
  const double u = e > 0 ? clamped((b * s + f) / e) : 0;
  s = a > 0 ? clamped((b * u - c) / a) : 0;
  const auto weights = [](double at, double on) {
    return std::array<double, 4>{1 - at, at, on - 1, -on};
  };
  if (best.take(weights(s, u))) return best.found();
  for (const double end : {0.0, 1.0}) {
    best.take(weights(end, place_on(p[2], d2, p[0] + end * d1)));
    best.take(weights(place_on(p[0], d1, p[2] + end * d2), end));
  }
  const Vec3 n = d1.cross(d2);
  best.take_along(weights(s, u), n.dot(r) > 0 ? n : -n);
  return best.found();
}

}  // namespace

// Coordinates relative to the first point: differences of doubles are exact to rounding however far
// from the origin they are.
Separation separation_of(PairKind kind, const FourPoints& p) {
  const FourPoints near{Vec3::Zero(), p[1] - p[0], p[2] - p[0], p[3] - p[0]};
  return kind == PairKind::kVertexTriangle ? of_vertex_triangle(near) : of_edges(near);
}

double relative_motion(PairKind kind, const FourPoints& d) {
  double square = 0;
  each_corners(kind, [&](std::size_t i, std::size_t j) {
    square = std::max(square, (d[i] - d[j]).squaredNorm());
  });
  return std::sqrt(square);
}

TimeOfImpact time_of_impact(PairKind kind, const FourPoints& p, const FourPoints& d, double gap,
                            double radius) {
  const FourPoints from{Vec3::Zero(), p[1] - p[0], p[2] - p[0], p[3] - p[0]},
      way{Vec3::Zero(), d[1] - d[0], d[2] - d[0], d[3] - d[0]};
  double size = 0;
  for (std::size_t k = 1; k < 4; ++k)
    size = std::max({size, from[k].cwiseAbs().maxCoeff(), way[k].cwiseAbs().maxCoeff()});
  gap = std::max(gap, kRounding * size);
  const double most = relative_motion(kind, way);

  TimeOfImpact result;
  double s = 0;
  FourPoints now = from;
  for (int advance = 0; advance < kMostAdvances; ++advance) {
    result.then = kind == PairKind::kVertexTriangle ? of_vertex_triangle(now) : of_edges(now);
    result.then.gap -= radius;
    result.s = s;
    if (!(result.then.gap > gap)) {
      result.hit = true;
      return result;
    }
    double step = most > 0 ? (result.then.gap - 0.5 * gap) / most : HUGE_VAL, plane = HUGE_VAL;
    each_corners(kind, [&](std::size_t i, std::size_t j) {
      const double rate = result.then.normal.dot(way[i] - way[j]);
      if (rate < 0)
        plane =
            std::min(plane, (result.then.normal.dot(now[i] - now[j]) - radius - 0.5 * gap) / -rate);
    });
    s += std::max(step, plane);
    if (!(s < 1)) {
      result.s = 1;
      return result;
    }
    for (std::size_t k = 1; k < 4; ++k) now[k] = from[k] + s * way[k];
  }
  result.hit = true;
  return result;
}

}  // namespace sim
