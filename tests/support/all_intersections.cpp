#include "tests/support/all_intersections.h"

#include <algorithm>
#include <set>

namespace sim_test {
namespace {

using Point = std::array<long double, 3>;

// Moller & Trumbore (1997), J. Graphics Tools 2(1): p + s (q - p) = a + u (b - a) + v (c - a).
bool passes(const Point& p, const Point& q, const Point& a, const Point& b, const Point& c) {
  const auto minus = [](const Point& x, const Point& y) {
    return Point{x[0] - y[0], x[1] - y[1], x[2] - y[2]};
  };
  const auto dot = [](const Point& x, const Point& y) {
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  };
  const auto cross = [](const Point& x, const Point& y) {
    return Point{x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
  };
  const Point along = minus(q, p), ab = minus(b, a), ac = minus(c, a), from = minus(p, a);
  const Point h = cross(along, ac);
  const long double det = dot(ab, h);
  // An edge in the plane, to the rounding of these numbers, goes along it and not through it.
  if (det * det <= 1e-34L * dot(along, along) * dot(ab, ab) * dot(ac, ac)) return false;
  const long double u = dot(from, h) / det;
  if (!(u > 0 && u < 1)) return false;
  const Point g = cross(from, ab);
  const long double v = dot(along, g) / det, s = dot(ac, g) / det;
  return v > 0 && u + v < 1 && s > 0 && s < 1;
}

}  // namespace

std::int64_t all_crossings(const std::vector<sim::Vec3>& places,
                           const std::vector<std::array<int, 3>>& triangles) {
  std::vector<Point> points;
  for (const sim::Vec3& x : places) points.push_back({x.x(), x.y(), x.z()});
  std::set<std::array<int, 2>> edges;
  for (const auto& t : triangles)
    for (std::size_t k = 0; k < 3; ++k)
      edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
  const auto at = [&](int i) -> const Point& { return points[static_cast<std::size_t>(i)]; };
  std::int64_t count = 0;
  for (const auto& [i, j] : edges)
    for (const auto& t : triangles) {
      if (std::ranges::count(t, i) + std::ranges::count(t, j) > 0) continue;
      bool apart = false;
      for (std::size_t axis = 0; axis < 3 && !apart; ++axis) {
        const auto least = std::min({at(t[0])[axis], at(t[1])[axis], at(t[2])[axis]}),
                   most = std::max({at(t[0])[axis], at(t[1])[axis], at(t[2])[axis]});
        apart =
            std::max(at(i)[axis], at(j)[axis]) < least || std::min(at(i)[axis], at(j)[axis]) > most;
      }
      count += !apart && passes(at(i), at(j), at(t[0]), at(t[1]), at(t[2]));
    }
  return count;
}

}  // namespace sim_test
