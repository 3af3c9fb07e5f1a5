#include "core/particles/elements/mesh_intersections.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/particles/elements/torn_faces.h"

namespace sim {
namespace {

// Six times the signed volume between four points, in extended precision.
class Volume {
 public:
  Volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    long double u[3], v[3], w[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      u[axis] = static_cast<long double>(b[axis]) - a[axis];
      v[axis] = static_cast<long double>(c[axis]) - a[axis];
      w[axis] = static_cast<long double>(d[axis]) - a[axis];
    }
    value_ = u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
             u[2] * (v[0] * w[1] - v[1] * w[0]);
  }
  int sign() const { return value_ > 0 ? 1 : value_ < 0 ? -1 : 0; }

 private:
  long double value_;
};

}  // namespace

// Segment-triangle intersection: the ends lie on both sides of the plane, and the line passes all
// edges of the triangle on the same side.
bool segment_meets_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b,
                            const Vec3& c) {
  const int above = Volume(a, b, c, p).sign();
  if (above == 0 || above + Volume(a, b, c, q).sign() != 0) return false;
  const int side = Volume(p, q, a, b).sign();
  return side != 0 && Volume(p, q, b, c).sign() == side && Volume(p, q, c, a).sign() == side;
}

MeshIntersections::MeshIntersections(
    std::span<const std::shared_ptr<const TriangleMesh>> surfaces) {
  for (const auto& surface : surfaces) {
    const int first = static_cast<int>(triangles_.size());
    triangles_.insert(triangles_.end(), surface->triangles().begin(), surface->triangles().end());
    for (const TriangleMesh::Edge& edge : surface->edges()) {
      edges_.push_back(edge.ends);
      triangle_of_.push_back(first + edge.triangles[0]);
    }
  }
  boxes_.resize(triangles_.size());
}

// Sorts the boxes by the cell of their lowest corner, on a grid over the two axes with the most
// cells as wide as the widest box, with at most some two cells a box. False if a number is not
// finite.
bool MeshIntersections::sort(const ParticleView& view) {
  Vec3 least = Vec3::Constant(HUGE_VAL), most = -least, widest{0, 0, 0};
  for (std::size_t k = 0; k < boxes_.size(); ++k) {
    Reach& box = boxes_[k];
    const auto& [a, b, c] = triangles_[k];
    const Vec3 at[] = {view.position(a), view.position(b), view.position(c)};
    box.least = at[0].cwiseMin(at[1]).cwiseMin(at[2]);
    box.most = at[0].cwiseMax(at[1]).cwiseMax(at[2]);
    if (!(at[0] + at[1] + at[2]).allFinite()) return false;
    least = least.cwiseMin(box.least);
    most = most.cwiseMax(box.least);
    widest = widest.cwiseMax(box.most - box.least);
  }
  const double usual = std::sqrt(2.0 * static_cast<double>(boxes_.size()));
  const auto cells = [&](int axis) {
    const double count = (most[axis] - least[axis]) / widest[axis];
    return count >= 1 ? static_cast<int>(std::min(count, usual)) : 1;
  };
  int least_split = 0;
  for (const int axis : {1, 2})
    if (cells(axis) < cells(least_split)) least_split = axis;
  int next = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == least_split) continue;
    Line& line = lines_[next++];
    line = {axis, cells(axis), least[axis], 0, widest[axis]};
    line.inverse = line.count > 1 ? line.count / (most[axis] - least[axis]) : 0;
  }

  const auto cell_of = [&](const Reach& box) {
    return static_cast<std::size_t>(lines_[0].cell(box.least[lines_[0].axis]) * lines_[1].count +
                                    lines_[1].cell(box.least[lines_[1].axis]));
  };
  starts_.assign(static_cast<std::size_t>(lines_[0].count * lines_[1].count) + 1, 0);
  for (const Reach& box : boxes_) ++starts_[cell_of(box) + 1];
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  order_.resize(boxes_.size());
  next_.assign(starts_.begin(), starts_.end());
  for (std::size_t k = 0; k < boxes_.size(); ++k)
    order_[static_cast<std::size_t>(next_[cell_of(boxes_[k])]++)] = static_cast<int>(k);
  return true;
}

// Boxes that may intersect an edge begin no later than the edge ends, and no earlier than the
// widest box before it begins.
template <class Found>
void MeshIntersections::each(const ParticleView& view, const Found& found) {
  if (boxes_.empty() || !sort(view)) return;
  const auto& [u, w] = lines_;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    if (!gone_.edges.empty() && gone_.edges[e]) continue;
    const auto& [i, j] = edges_[e];
    const Vec3 p = view.position(i), q = view.position(j);
    const Vec3 least = p.cwiseMin(q), most = p.cwiseMax(q);
    const int first = w.cell(least[w.axis] - w.widest), last = w.cell(most[w.axis]);
    for (int row = u.cell(least[u.axis] - u.widest); row <= u.cell(most[u.axis]); ++row) {
      const auto begin = static_cast<std::size_t>(row * w.count + first),
                 end = static_cast<std::size_t>(row * w.count + last + 1);
      for (int at = starts_[begin]; at < starts_[end]; ++at) {
        const auto k = static_cast<std::size_t>(order_[static_cast<std::size_t>(at)]);
        if (!gone_.triangles.empty() && gone_.triangles[k]) continue;
        const Reach& box = boxes_[k];
        if (box.most[0] < least[0] || box.least[0] > most[0] || box.most[1] < least[1] ||
            box.least[1] > most[1] || box.most[2] < least[2] || box.least[2] > most[2])
          continue;
        const auto& [a, b, c] = triangles_[k];
        if (i == a || i == b || i == c || j == a || j == b || j == c) continue;
        if (segment_meets_triangle(p, q, view.position(a), view.position(b), view.position(c)) &&
            !found(e, k))
          return;
      }
    }
  }
}

void MeshIntersections::tear(TornPairs torn) { gone_ = torn_parts(torn, triangles_, edges_); }

std::int64_t MeshIntersections::count(const ParticleView& view) {
  std::int64_t count = 0;
  each(view, [&](std::size_t, std::size_t) { return ++count > 0; });
  return count;
}

std::vector<TriangleMesh::Triangle> MeshIntersections::first(const ParticleView& view) {
  std::vector<TriangleMesh::Triangle> pair;
  each(view, [&](std::size_t edge, std::size_t triangle) {
    pair = {triangles_[static_cast<std::size_t>(triangle_of_[edge])], triangles_[triangle]};
    return false;
  });
  return pair;
}

}  // namespace sim
