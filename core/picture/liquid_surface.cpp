#include "core/picture/liquid_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/math/median.h"

namespace sim {
namespace {

using Cell = std::array<std::size_t, 3>;

// A grid around the particles, with sums over those that are near each of its points.
class SurfaceGrid {
 public:
  SurfaceGrid(std::span<const Vec3> particles, double spacing) : reach_(2 * spacing) {
    constexpr double kMostPoints = 2e6;
    Vec3 high = particles.front();
    low_ = high;
    for (const Vec3& x : particles) {
      low_ = low_.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    low_ -= Vec3(reach_, reach_, reach_);
    high += Vec3(reach_, reach_, reach_);
    // Drops that fly off make the cells larger.
    std::array<double, 3> n{};
    for (size_ = 0.5 * spacing;; size_ *= 1.25) {
      for (std::size_t c = 0; c < 3; ++c) n[c] = 2 + std::ceil((high[c] - low_[c]) / size_);
      if (n[0] * n[1] * n[2] < kMostPoints) break;
    }
    for (std::size_t c = 0; c < 3; ++c) count_[c] = static_cast<std::size_t>(n[c]);
    step_ = {1, count_[0], count_[0] * count_[1]};
    weight_.resize(count_[0] * count_[1] * count_[2]);
    sums_.resize(4 * weight_.size());
  }

  void add(const Vec3& x, double value) {
    Cell from, to;
    for (std::size_t c = 0; c < 3; ++c) {
      from[c] =
          static_cast<std::size_t>(std::max(0.0, std::ceil((x[c] - reach_ - low_[c]) / size_)));
      to[c] = std::min(count_[c] - 1,
                       static_cast<std::size_t>(std::floor((x[c] + reach_ - low_[c]) / size_)));
    }
    for (std::size_t k = from[2]; k <= to[2]; ++k)
      for (std::size_t j = from[1]; j <= to[1]; ++j)
        for (std::size_t i = from[0]; i <= to[0]; ++i) {
          const double s = 1 - (point({i, j, k}) - x).squaredNorm() / (reach_ * reach_);
          if (s <= 0) continue;
          const double w = s * s * s;
          const std::size_t at = index({i, j, k});
          weight_[at] += static_cast<float>(w);
          float* sum = &sums_[4 * at];
          for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<float>(w * (x[c] - low_[c]));
          sum[3] += static_cast<float>(w * value);
        }
  }

  LiquidSurface surface(double radius, bool values) {
    measure(radius);
    id_.resize(weight_.size());
    LiquidSurface mesh;
    for (std::size_t k = 0; k + 1 < count_[2]; ++k)
      for (std::size_t j = 0; j + 1 < count_[1]; ++j)
        for (std::size_t i = 0; i + 1 < count_[0]; ++i) add_point({i, j, k}, values, mesh);
    for (std::size_t k = 1; k + 1 < count_[2]; ++k)
      for (std::size_t j = 1; j + 1 < count_[1]; ++j)
        for (std::size_t i = 1; i + 1 < count_[0]; ++i) add_squares(index({i, j, k}), mesh);
    return mesh;
  }

 private:
  std::size_t index(const Cell& at) const { return at[0] + step_[1] * at[1] + step_[2] * at[2]; }
  Vec3 point(const Cell& at) const {
    return {low_[0] + size_ * static_cast<double>(at[0]),
            low_[1] + size_ * static_cast<double>(at[1]),
            low_[2] + size_ * static_cast<double>(at[2])};
  }

  // The signed distance to the surface, m; positive outside.
  void measure(double radius) {
    distance_.assign(weight_.size(), static_cast<float>(radius));
    for (std::size_t k = 0; k < count_[2]; ++k)
      for (std::size_t j = 0; j < count_[1]; ++j)
        for (std::size_t i = 0; i < count_[0]; ++i) {
          const std::size_t at = index({i, j, k});
          if (!(weight_[at] > 0)) continue;
          const float* sum = &sums_[4 * at];
          const Vec3 mean = Vec3(sum[0], sum[1], sum[2]) / weight_[at] + low_;
          distance_[at] = static_cast<float>((mean - point({i, j, k})).norm() - radius);
        }
  }

  // In a cell that the surface crosses, the mean of its crossings with the cell's edges.
  void add_point(const Cell& cell, bool values, LiquidSurface& mesh) {
    std::array<std::size_t, 8> corner{};
    int inside = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      corner[k] = index({cell[0] + (k & 1), cell[1] + (k >> 1 & 1), cell[2] + (k >> 2)});
      inside += distance_[corner[k]] < 0;
    }
    if (inside == 0 || inside == 8) return;
    Vec3 sum = Vec3::Zero();
    double crossings = 0, value = 0, weight = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      const double f = distance_[corner[k]];
      value += sums_[4 * corner[k] + 3];
      weight += weight_[corner[k]];
      for (std::size_t c = 0; c < 3; ++c) {
        if (k >> c & 1) continue;
        const double g = distance_[corner[k | std::size_t{1} << c]];
        if ((f < 0) == (g < 0)) continue;
        ++crossings;
        for (std::size_t b = 0; b < 3; ++b)
          sum[b] += b == c ? f / (f - g) : static_cast<double>(k >> b & 1);
      }
    }
    id_[corner[0]] = static_cast<int>(mesh.points.size());
    mesh.points.push_back(point(cell) + size_ / crossings * sum);
    if (values) mesh.values.push_back(value / weight);
  }

  // Around each edge of the grid that the surface crosses.
  void add_squares(std::size_t at, LiquidSurface& mesh) const {
    const bool inside = distance_[at] < 0;
    for (std::size_t c = 0; c < 3; ++c) {
      if (inside == (distance_[at + step_[c]] < 0)) continue;
      const std::size_t u = step_[(c + 1) % 3], w = step_[(c + 2) % 3];
      std::array<int, 4> q{id_[at - u - w], id_[at - w], id_[at], id_[at - u]};
      if (!inside) std::ranges::reverse(q);
      mesh.triangles.push_back({q[0], q[1], q[2]});
      mesh.triangles.push_back({q[0], q[2], q[3]});
    }
  }

  double reach_, size_ = 1;  // m: how far a particle counts, and the size of a cell
  Vec3 low_{0, 0, 0};
  Cell count_{}, step_{};
  std::vector<float> weight_, sums_;  // sums: position from low_, value
  std::vector<float> distance_;
  std::vector<int> id_;  // of the point in a cell, by its lowest corner
};

}  // namespace

std::vector<int> liquid_of(const Model& model) {
  constexpr std::size_t kFewest = 60;
  std::vector<bool> other = model.in_triangles();
  const auto mark = [&](int i) { other[static_cast<std::size_t>(i)] = true; };
  for (const int i : model.pinned) mark(i);
  for (const ModelFamily& family : model.families)
    for (const auto& [a, b] : family.ends) mark(a), mark(b);
  for (const ModelTie& tie : model.ties)
    for (const ModelPoint& end : tie)
      for (int k = 0; k < end.count; ++k) mark(end.ids[static_cast<std::size_t>(k)]);
  std::vector<int> liquid;
  for (int i = 0; i < model.particles; ++i)
    if (!other[static_cast<std::size_t>(i)]) liquid.push_back(i);
  if (liquid.size() < kFewest) liquid.clear();
  return liquid;
}

double liquid_spacing(const Frame& frame, std::span<const int> liquid) {
  constexpr std::size_t kSamples = 100;
  const std::size_t every = (liquid.size() + kSamples - 1) / kSamples;
  std::vector<double> distances;
  for (std::size_t k = 0; k < liquid.size(); k += every) {
    double least = HUGE_VAL;
    for (const int other : liquid)
      if (other != liquid[k])
        least = std::min(least, (frame.at(other) - frame.at(liquid[k])).norm());
    distances.push_back(least);
  }
  return median(std::move(distances));
}

LiquidSurface liquid_surface(std::span<const Vec3> particles, double spacing,
                             std::span<const double> values) {
  if (particles.empty() || !(spacing > 0) || !std::isfinite(spacing)) return {};
  SurfaceGrid grid(particles, spacing);
  for (std::size_t i = 0; i < particles.size(); ++i)
    grid.add(particles[i], values.empty() ? 0.0 : values[i]);
  return grid.surface(0.62 * spacing, !values.empty());
}

}  // namespace sim
