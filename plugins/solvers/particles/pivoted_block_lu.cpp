#include "pivoted_block_lu.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/base/assert.h"
#include "core/base/slot.h"

namespace sim {

bool PivotedBlock::factorise(const Mat3& block) {
  factors_ = block;
  row_ = {0, 1, 2};
  for (std::size_t k = 0; k < 3; ++k) {
    std::size_t most = k;
    for (std::size_t i = k + 1; i < 3; ++i)
      if (std::fabs(factors_(row_[i], k)) > std::fabs(factors_(row_[most], k))) most = i;
    std::swap(row_[k], row_[most]);
    const double pivot = factors_(row_[k], k);
    if (!(std::fabs(pivot) > 0) || !std::isfinite(pivot)) return false;
    const double inverse = factors_(row_[k], k) = 1 / pivot;
    for (std::size_t i = k + 1; i < 3; ++i) {
      const double share = factors_(row_[i], k) *= inverse;
      for (std::size_t j = k + 1; j < 3; ++j) factors_(row_[i], j) -= share * factors_(row_[k], j);
    }
  }
  return true;
}

Vec3 PivotedBlock::divide(const Vec3& b) const {
  Vec3 x;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = b[row_[i]];
    for (std::size_t j = 0; j < i; ++j) x[i] -= factors_(row_[i], j) * x[j];
  }
  for (std::size_t i = 3; i-- > 0;) {
    for (std::size_t j = i + 1; j < 3; ++j) x[i] -= factors_(row_[i], j) * x[j];
    x[i] *= factors_(row_[i], i);
  }
  return x;
}

PivotedBlockLu::PivotedBlockLu(std::span<const int> rows, BlockPairs pairs) {
  std::size_t size = 0;
  for (const int row : rows) size += row >= 0;
  std::vector<std::vector<int>> behind(size);
  for (const auto& [a, b] : pairs) {
    const auto [low, high] = std::minmax(rows[slot(a)], rows[slot(b)]);
    if (low >= 0 && low < high) behind[slot(low)].push_back(high);
  }
  // Elimination of a row joins all rows behind it; it is enough to tell the first of them.
  for (std::vector<int>& row : behind) {
    std::ranges::sort(row);
    row.erase(std::unique(row.begin(), row.end()), row.end());
    if (row.size() > 1)
      std::copy(row.begin() + 1, row.end(), std::back_inserter(behind[slot(row[0])]));
  }
  begin_.push_back(0);
  for (const std::vector<int>& row : behind) {
    column_.insert(column_.end(), row.begin(), row.end());
    begin_.push_back(static_cast<int>(column_.size()));
  }
  for (const std::vector<int>& row : behind)
    for (std::size_t s = 0; s < row.size(); ++s)
      for (std::size_t t = s + 1; t < row.size(); ++t) target_.push_back(pair(row[s], row[t]));
  diagonal_.resize(size);
  pivot_.resize(size);
  upper_.resize(column_.size());
  lower_.resize(column_.size());
}

void PivotedBlockLu::clear() {
  for (std::vector<Mat3>* blocks : {&diagonal_, &upper_, &lower_})
    std::ranges::fill(*blocks, Mat3::Zero());
}

int PivotedBlockLu::pair(int low, int high) const {
  const auto from = column_.begin() + begin_[slot(low)],
             to = column_.begin() + begin_[slot(low) + 1];
  const auto found = std::lower_bound(from, to, high);
  SIM_ASSERT(found != to && *found == high);
  return static_cast<int>(found - column_.begin());
}

// U_kj = D_k^-1 A_kj,  A_ij -= A_ik U_kj  for all i, j behind k.
bool PivotedBlockLu::factorise() {
  auto target = target_.begin();
  for (std::size_t k = 0; k < diagonal_.size(); ++k) {
    if (!pivot_[k].factorise(diagonal_[k])) return false;
    const std::size_t from = slot(begin_[k]), to = slot(begin_[k + 1]);
    for (std::size_t s = from; s < to; ++s) {
      const Mat3 block = upper_[s];
      upper_[s] = transposed({pivot_[k].divide(block.column(0)), pivot_[k].divide(block.column(1)),
                              pivot_[k].divide(block.column(2))});
    }
    for (std::size_t s = from; s < to; ++s) {
      diagonal_[slot(column_[s])] -= lower_[s] * upper_[s];
      for (std::size_t t = s + 1; t < to; ++t, ++target) {
        upper_[slot(*target)] -= lower_[s] * upper_[t];
        lower_[slot(*target)] -= lower_[t] * upper_[s];
      }
    }
  }
  return true;
}

void PivotedBlockLu::solve(std::span<Vec3> x) const {
  for (std::size_t k = 0; k < diagonal_.size(); ++k) {
    x[k] = pivot_[k].divide(x[k]);
    for (std::size_t s = slot(begin_[k]); s < slot(begin_[k + 1]); ++s)
      x[slot(column_[s])] -= lower_[s] * x[k];
  }
  for (std::size_t k = diagonal_.size(); k-- > 0;)
    for (std::size_t s = slot(begin_[k]); s < slot(begin_[k + 1]); ++s)
      x[k] -= upper_[s] * x[slot(column_[s])];
}

}  // namespace sim
