#include "core/particles/neighbours/cell_grid.h"

#include <algorithm>
#include <cmath>

#include "core/base/assert.h"

namespace sim {
namespace {

// Cells are slightly wider than the cutoff and coordinates bounded, so that rounding of a
// coordinate (below kFar 2^-51) cannot separate neighbours.
constexpr double kWiden = 1.001, kFar = 0x1p36;

// The median of about a thousand of the values; 0 if none of these is finite.
double median(const double* values, int n, std::vector<double>& sample) {
  sample.clear();
  for (int i = 0; i < n; i += n / 1024 + 1)
    if (std::isfinite(values[i])) sample.push_back(values[i]);
  if (sample.empty()) return 0;
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  return *middle;
}

}  // namespace

void CellGrid::sort(const ParticleView& view, double width) {
  SIM_ASSERT(width > 0);
  const auto n = static_cast<std::size_t>(view.n);
  const double* const q[3] = {view.x, view.y, view.z};
  std::int64_t cells = 1;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double>& coordinate = coordinates_[axis];
    coordinate.resize(n);
    const double origin = median(q[axis], view.n, sample_), inverse = 1 / (width * kWiden);
    double low = kFar, high = -kFar;
    for (std::size_t i = 0; i < n; ++i) {
      const double at = std::floor((q[axis][i] - origin) * inverse);
      coordinate[i] = at >= -kFar ? std::min(at, kFar) : -kFar;  // the latter for nan, too
      low = std::min(low, coordinate[i]);
      high = std::max(high, coordinate[i]);
    }
    for (double& at : coordinate) at -= low;
    size_[axis] = static_cast<int>(std::clamp(high - low + 1, 3.0, 0x1p20));
    cells *= size_[axis];
  }
  for (const std::int64_t most = 64 + 2 * static_cast<std::int64_t>(n); cells > most;) {
    int& largest = *std::max_element(size_, size_ + 3);
    cells /= largest;
    largest = std::max(3, (largest + 1) / 2);
    cells *= largest;
  }

  // A counting sort, which keeps the ids of a cell in their order.
  cell_of_.resize(n);
  starts_.assign(static_cast<std::size_t>(cells) + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    int cell = 0;
    for (int axis = 2; axis >= 0; --axis) {
      auto at = static_cast<std::int64_t>(coordinates_[axis][i]);
      if (at >= size_[axis]) at %= size_[axis];
      cell = cell * size_[axis] + static_cast<int>(at);
    }
    cell_of_[i] = cell;
    ++starts_[static_cast<std::size_t>(cell) + 1];
  }
  for (std::size_t cell = 1; cell < starts_.size(); ++cell) starts_[cell] += starts_[cell - 1];
  SIM_ASSERT(starts_.back() == view.n);
  next_ = starts_;
  order_.resize(n);
  cells_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto place = static_cast<std::size_t>(next_[static_cast<std::size_t>(cell_of_[i])]++);
    order_[place] = static_cast<std::int32_t>(i);
    cells_[place] = cell_of_[i];
  }
}

CellGrid::Rows CellGrid::around(int cell) const {
  const auto [a, b, c] = size_;
  SIM_ASSERT(0 <= cell && cell < a * b * c);
  const int x = cell % a, y = cell / a % b, z = cell / a / b;
  Rows rows{};
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy) {
      const int first = a * ((y + dy + b) % b + b * ((z + dz + c) % c));
      const auto add = [&](int begin, int end) {  // cells [begin, end) of this line
        const Row row = {starts_[static_cast<std::size_t>(first + begin)],
                         starts_[static_cast<std::size_t>(first + end)]};
        if (row.begin < row.end) rows.at[rows.count++] = row;
      };
      add(std::max(x - 1, 0), std::min(x + 2, a));
      if (x == 0) add(a - 1, a);
      if (x == a - 1) add(0, 1);
    }
  SIM_ASSERT(rows.count <= static_cast<int>(std::size(rows.at)));
  return rows;
}

}  // namespace sim
