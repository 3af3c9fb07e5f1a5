#include "self_collision_culling.h"

#include <algorithm>

#include "core/base/slot.h"

namespace sim {
namespace {

constexpr int kLeastCols = 18;  // two vectors of any machine

}  // namespace

std::optional<SheetGrid> sheet_of(const TriangleMesh& surface) {
  const auto triangles = surface.triangles();
  const TriangleMesh::Triangle& t = triangles.front();
  const int low = t[0], mid = std::min(t[1], t[2]), high = std::max(t[1], t[2]);
  const int cols = high - mid == 1 ? mid - low : -1;
  if (cols < kLeastCols) return {};
  const SheetGrid grid{low, static_cast<int>(triangles.size()) / (2 * (cols - 1)) + 1, cols};
  std::vector<TriangleMesh::Triangle> plain =
      grid_triangles({grid.rows, grid.cols, 1}, t[1] > t[2]);
  for (auto& each : plain)
    for (int& id : each) id += grid.first;
  return std::ranges::equal(plain, triangles) ? std::optional(grid) : std::nullopt;
}

// The axes are as near to both directions as an orthogonal pair can be.
bool SelfCollisionCulling::stays_open(const std::array<const double*, 3>& q0,
                                      const std::array<const double*, 3>& q1, double distance) {
  const auto at = [&](int i, int j) {
    const auto id = slot(grid_.first + i * grid_.cols + j);
    return Vec3(q0[0][id], q0[1][id], q0[2][id]);
  };
  Vec3 down = Vec3::Zero(), along = Vec3::Zero();
  for (int j = 0; j < grid_.cols; ++j) down += at(grid_.rows - 1, j) - at(0, j);
  for (int i = 0; i < grid_.rows; ++i) along += at(i, grid_.cols - 1) - at(i, 0);
  const Vec3 u = down.normalized(), v = along.normalized();
  const Vec3 sum = (u + v).normalized(), rest = (u - v).normalized();
  const Vec3 e[2] = {(sum + rest) * std::sqrt(0.5), (sum - rest) * std::sqrt(0.5)};
  // Rounding of the axes may lengthen projections.
  const double c = distance * std::sqrt(2.0) * (1 + 1e-9);
  const double axes[2][3] = {{e[0].x(), e[0].y(), e[0].z()}, {e[1].x(), e[1].y(), e[1].z()}};
  return unfolded_(q0.data(), grid_, axes, c, scratch_.data()) &&
         unfolded_(q1.data(), grid_, axes, c, scratch_.data());
}

}  // namespace sim
