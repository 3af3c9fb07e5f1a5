#include "hull.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace sim {
namespace {

constexpr double kFlat = 1e-6;  // of the size: the deviation of one plane

// Builds the hull of a mesh, step by step.
class HullBuilder {
 public:
  explicit HullBuilder(const RigidShape& mesh) {
    hull_.points = mesh.points;
    hull_.triangles = mesh.triangles;
    for (const auto& t : mesh.triangles)
      for (const int i : t) hull_.middle += point(i) / (3.0 * mesh.triangles.size());
    for (const auto& t : mesh.triangles)
      for (const int i : t) size_ = std::max(size_, (point(i) - hull_.middle).norm());
  }

  std::optional<Hull> make() {
    if (!find_planes() || !is_convex()) return {};
    join_triangles();
    for (std::size_t t = 0; t < group_.size(); ++t)
      if (group_[t] == t && !add_face(t)) return {};
    for (const auto& [edge, t] : sides_) {
      const std::size_t other = sides_.at({edge[1], edge[0]});
      if (edge[0] < edge[1] && group_[t] != group_[other])
        hull_.edges.push_back({edge[0], edge[1], normals_[group_[t]], normals_[group_[other]]});
    }
    return std::move(hull_);
  }

 private:
  const Vec3& point(int i) const { return hull_.points[static_cast<std::size_t>(i)]; }

  bool find_planes() {
    for (std::size_t t = 0; t < hull_.triangles.size(); ++t) {
      const auto& [a, b, c] = hull_.triangles[t];
      const Vec3 across = (point(b) - point(a)).cross(point(c) - point(a));
      const double area = across.norm();
      if (!(area > kFlat * kFlat * size_ * size_)) return false;
      normals_.push_back(across / area);
      sides_[{a, b}] = sides_[{b, c}] = sides_[{c, a}] = t;
    }
    return true;
  }

  bool is_convex() const {
    for (std::size_t t = 0; t < normals_.size(); ++t)
      for (const auto& other : hull_.triangles)
        for (const int i : other)
          if (normals_[t].dot(point(i) - point(hull_.triangles[t][0])) > kFlat * size_)
            return false;
    return true;
  }

  // Neighbouring coplanar triangles get the same group: the least of their numbers.
  void join_triangles() {
    group_.resize(normals_.size());
    std::iota(group_.begin(), group_.end(), std::size_t{0});
    for (bool changed = true; changed;) {
      changed = false;
      for (const auto& [edge, t] : sides_) {
        const std::size_t other = sides_.at({edge[1], edge[0]});
        if (normals_[t].cross(normals_[other]).norm() > kFlat || group_[t] == group_[other])
          continue;
        group_[t] = group_[other] = std::min(group_[t], group_[other]);
        changed = true;
      }
    }
  }

  // The boundary loop of the triangles of a group.
  bool add_face(std::size_t group) {
    std::map<int, int> next;
    for (const auto& [edge, t] : sides_)
      if (group_[t] == group && group_[sides_.at({edge[1], edge[0]})] != group)
        if (!next.emplace(edge[0], edge[1]).second) return false;
    if (next.size() < 3 || next.size() > Hull::kMostCorners) return false;
    const int begin = static_cast<int>(hull_.corners.size()), first = next.begin()->first;
    int corner = first;
    for (std::size_t k = 0; k < next.size(); ++k) {
      hull_.corners.push_back(corner);
      corner = next.at(corner);
      if (corner == first && k + 1 < next.size()) return false;  // several loops
    }
    hull_.faces.push_back({normals_[group], normals_[group].dot(point(first)), begin,
                           static_cast<int>(hull_.corners.size())});
    return true;
  }

  Hull hull_;
  double size_ = 0;
  std::vector<Vec3> normals_;                        // of triangles
  std::vector<std::size_t> group_;                   // of triangles: one a face
  std::map<std::array<int, 2>, std::size_t> sides_;  // the triangle on the left of an edge
};

}  // namespace

Vec3 Hull::farthest(const Vec3& direction) const {
  Vec3 best;
  double most = -HUGE_VAL;
  for (const Vec3& point : points)
    if (const double along = point.dot(direction); along > most) most = along, best = point;
  return best;
}

std::optional<Hull> hull_of(const RigidShape& shape) {
  if (shape.is_round() || shape.form == RigidShape::Form::kCompound) return {};
  return HullBuilder(mesh_of(shape)).make();
}

}  // namespace sim
