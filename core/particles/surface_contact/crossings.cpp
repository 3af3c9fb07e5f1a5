#include "core/particles/surface_contact/crossings.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

// Six times the volume of a tetrahedron, with the digits that differences of doubles need.
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

// The ends lie on both sides of the plane, and the line passes all sides of the triangle alike.
bool meet(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  const int above = Volume(a, b, c, p).sign();
  if (above == 0 || above + Volume(a, b, c, q).sign() != 0) return false;
  const int side = Volume(p, q, a, b).sign();
  return side != 0 && Volume(p, q, b, c).sign() == side && Volume(p, q, c, a).sign() == side;
}

}  // namespace

Crossings::Crossings(std::span<const std::shared_ptr<const TriangleMesh>> surfaces) {
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

// Boxes of triangles in the order of their least x: those that an edge may meet begin no further
// than it ends, and no more than the widest of them before it begins.
template <class Found>
void Crossings::each(const ParticleView& view, const Found& found) {
  double widest = 0;
  for (std::size_t k = 0; k < boxes_.size(); ++k) {
    Reach& box = boxes_[k];
    box.of = static_cast<int>(k);
    const Vec3 a = view.position(triangles_[k][0]), b = view.position(triangles_[k][1]),
               c = view.position(triangles_[k][2]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.least[axis] = std::min({a[axis], b[axis], c[axis]});
      box.most[axis] = std::max({a[axis], b[axis], c[axis]});
    }
    widest = std::max(widest, box.most[0] - box.least[0]);
  }
  if (!std::isfinite(widest)) return;
  const auto first_x = [](const Reach& box) { return box.least[0]; };
  std::ranges::sort(boxes_, {}, first_x);

  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const auto& [i, j] = edges_[e];
    const Vec3 p = view.position(i), q = view.position(j);
    const Vec3 least = p.cwiseMin(q), most = p.cwiseMax(q);
    auto box = std::ranges::lower_bound(boxes_, least.x() - widest, {}, first_x);
    for (; box != boxes_.end() && box->least[0] <= most.x(); ++box) {
      if (box->most[0] < least.x() || box->least[1] > most.y() || box->most[1] < least.y() ||
          box->least[2] > most.z() || box->most[2] < least.z())
        continue;
      const auto& [a, b, c] = triangles_[static_cast<std::size_t>(box->of)];
      if (i == a || i == b || i == c || j == a || j == b || j == c) continue;
      if (meet(p, q, view.position(a), view.position(b), view.position(c)) &&
          !found(e, static_cast<std::size_t>(box->of)))
        return;
    }
  }
}

std::int64_t Crossings::count(const ParticleView& view) {
  std::int64_t count = 0;
  each(view, [&](std::size_t, std::size_t) { return ++count > 0; });
  return count;
}

std::vector<TriangleMesh::Triangle> Crossings::first(const ParticleView& view) {
  std::vector<TriangleMesh::Triangle> pair;
  each(view, [&](std::size_t edge, std::size_t triangle) {
    pair = {triangles_[static_cast<std::size_t>(triangle_of_[edge])], triangles_[triangle]};
    return false;
  });
  return pair;
}

}  // namespace sim
