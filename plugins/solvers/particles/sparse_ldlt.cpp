#include <algorithm>
#include <cmath>
#include <functional>

#include "core/base/assert.h"
#include "linear_solver.h"

namespace sim {

SparseLdlt::SparseLdlt(const BlockMatrix& matrix, BlockPairs pairs, std::vector<int> rows)
    : matrix_(&matrix), row_of_(std::move(rows)) {
  // The elimination order was found on the graph of nodes rather than of their coordinates.
  int free = 0;
  for (int& row : row_of_)
    if (row >= 0) row *= 3, ++free;
  const auto rows_of = [&](const std::array<int, 2>& pair) {
    return std::minmax(
        {row_of_[static_cast<std::size_t>(pair[0])], row_of_[static_cast<std::size_t>(pair[1])]});
  };

  // The pattern of the upper half, in that order.
  std::vector<std::pair<int, int>> entries;
  const auto add_block = [&](int low, int high) {
    for (int row = 0; row < 3; ++row)
      for (int col = low == high ? row : 0; col < 3; ++col)
        entries.emplace_back(low + row, high + col);
  };
  for (const int row : row_of_)
    if (row >= 0) add_block(row, row);
  for (const auto& pair : pairs)
    if (const auto [low, high] = rows_of(pair); low >= 0) add_block(low, high);
  upper_.emplace(3 * free, entries);
  for (const int row : row_of_) diagonal_.push_back(row < 0 ? Target{} : target(row, row));
  for (const auto& pair : matrix.fixed_pairs()) {
    const auto [low, high] = rows_of(pair);
    fixed_.push_back(low < 0 ? Target{} : target(low, high));
  }
  x_.resize(3 * static_cast<std::size_t>(free));
}

SparseLdlt::Target SparseLdlt::target(int low, int high) const {
  // The rows above the block are the same in its three columns.
  const int within = upper_->entry(low, high) - upper_->column(high);
  return {{upper_->column(high) + within, upper_->column(high + 1) + within,
           upper_->column(high + 2) + within}};
}

void SparseLdlt::assemble() {
  const std::span<double> values = upper_->values();
  std::ranges::fill(values, 0.0);
  for (std::size_t i = 0; i < row_of_.size(); ++i) {
    if (row_of_[i] < 0) continue;
    const Mat3 block = matrix_->diagonal(static_cast<int>(i));
    for (int col = 0; col < 3; ++col)
      for (int row = 0; row <= col; ++row) values[diagonal_[i].column[col] + row] = block(row, col);
  }
  auto fixed = fixed_.begin();
  const auto add_fixed = [&](int a, int b, const Mat3& block) {
    const Target& to = *fixed++;
    if (row_of_[static_cast<std::size_t>(a)] < 0 || row_of_[static_cast<std::size_t>(b)] < 0)
      return;
    for (int col = 0; col < 3; ++col)
      for (int row = 0; row < 3; ++row) values[to.column[col] + row] += block(row, col);
  };
  const auto add_other = [&](int i, int j, const Mat3& block) {
    const int at = row_of_[static_cast<std::size_t>(i)], by = row_of_[static_cast<std::size_t>(j)];
    if (at < 0 || by < 0) return;
    const Target to = target(std::min(at, by), std::max(at, by));
    for (int col = 0; col < 3; ++col)
      for (int row = 0; row < 3; ++row)
        values[to.column[col] + row] += at < by ? block(row, col) : block(col, row);
  };
  // Passed by reference, which allocates nothing.
  matrix_->for_each_pair(std::cref(add_fixed), std::cref(add_other));
  SIM_ASSERT(fixed == fixed_.end());  // the pairs that the pattern was made of
}

LinearResult SparseLdlt::solve(const double* b, double* d, double /*eta*/) {
  LinearResult result{.factorisations = 1};
  result.definite = prepare();
  if (result.definite) divide(b, d);
  return result;
}

double SparseLdlt::solve(const double* r, double* z) {
  divide(r, z);
  double sum = 0;
  for (std::size_t i = 0; i < matrix_->layout().size(); ++i) sum += r[i] * z[i];
  return sum;
}

bool SparseLdlt::prepare() {
  if (x_.empty()) return true;
  assemble();
  return upper_->factorise();
}

void SparseLdlt::divide(const double* r, double* z) {
  const Layout& layout = matrix_->layout();
  std::fill_n(z, layout.size(), 0.0);
  if (x_.empty()) return;
  const auto from = layout.axes(r);
  const auto to = layout.axes(z);
  for (int i = 0; i < layout.n(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (const int row = row_of_[static_cast<std::size_t>(i)]; row >= 0)
        x_[row + axis] = from[axis][i];
  upper_->solve(x_);
  for (int i = 0; i < layout.n(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (const int row = row_of_[static_cast<std::size_t>(i)]; row >= 0)
        to[axis][i] = x_[row + axis];
}

}  // namespace sim
