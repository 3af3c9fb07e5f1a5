#include "block_rows.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace sim {
namespace {

constexpr int kGrain = 64;  // nodes that one thread takes at least

// The inverse of a symmetric block; false where it is not positive definite.
bool invert(const Mat3& a, Mat3& inverse) {
  const double xx = a(1, 1) * a(2, 2) - a(1, 2) * a(1, 2),
               xy = a(0, 2) * a(1, 2) - a(0, 1) * a(2, 2),
               xz = a(0, 1) * a(1, 2) - a(0, 2) * a(1, 1);
  const double det = a(0, 0) * xx + a(0, 1) * xy + a(0, 2) * xz;
  const double minor = a(0, 0) * a(1, 1) - a(0, 1) * a(0, 1);
  if (!(a(0, 0) > 0 && minor > 0 && det > 0)) return false;
  const double yy = a(0, 0) * a(2, 2) - a(0, 2) * a(0, 2),
               yz = a(0, 1) * a(0, 2) - a(0, 0) * a(1, 2);
  inverse = Mat3({xx, xy, xz}, {xy, yy, yz}, {xz, yz, minor}) / det;
  return true;
}

void put(const Mat3& block, double* to) {
  for (std::size_t column = 0; column < 3; ++column)
    for (std::size_t row = 0; row < 3; ++row)
      to[column * BlockRows::kRow + row] = block(row, column);
}

// sum += block x
inline void add_product(const double* block, const double* x, double (&sum)[BlockRows::kRow]) {
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < BlockRows::kRow; ++row)
      sum[row] += block[column * BlockRows::kRow + row] * x[column];
}

}  // namespace

BlockRows::BlockRows(const BlockMatrix& matrix, BlockPairs pairs,
                     std::span<const std::uint8_t> free, ThreadPool& pool)
    : matrix_(&matrix), pool_(&pool), free_(free.begin(), free.end()) {
  const auto n = free_.size();
  const auto is_free = [&](int i) { return free_[static_cast<std::size_t>(i)] != 0; };
  std::vector<std::pair<int, int>> entries;
  entries.reserve(2 * pairs.size() + n);
  for (std::size_t i = 0; i < n; ++i) entries.emplace_back(i, i);
  for (const auto& [a, b] : pairs)
    if (a != b && is_free(a) && is_free(b)) {
      entries.emplace_back(a, b);
      entries.emplace_back(b, a);
    }
  Sparsity pattern(static_cast<int>(n), std::move(entries));
  begin_ = std::move(pattern.begin);
  columns_ = std::move(pattern.rows);
  blocks_ = Array(columns_.size() * kBlock);
  inverses_ = Array(n * kBlock);
  for (int i = 0; i < static_cast<int>(n); ++i) own_.push_back(place(i, i));
}

int BlockRows::place(int i, int j) const {
  const auto first = columns_.begin() + begin_[static_cast<std::size_t>(i)];
  const auto last = columns_.begin() + end(i);
  return static_cast<int>(std::lower_bound(first, last, j) - columns_.begin());
}

Mat3 BlockRows::block(int at) const {
  const double* const from = &blocks_[static_cast<std::size_t>(at) * kBlock];
  return {{from[0], from[kRow], from[2 * kRow]},
          {from[1], from[kRow + 1], from[2 * kRow + 1]},
          {from[2], from[kRow + 2], from[2 * kRow + 2]}};
}

bool BlockRows::take() {
  std::ranges::fill(blocks_.span(), 0.0);
  for (int i = 0; i < nodes(); ++i)
    if (free_[static_cast<std::size_t>(i)])
      put(matrix_->diagonal(i),
          &blocks_[static_cast<std::size_t>(own_[static_cast<std::size_t>(i)]) * kBlock]);
  // Blocks mostly come in the order of the time before, so that their places are known.
  std::size_t seen = 0;
  const auto add = [&](int i, int j, const Mat3& block) {
    if (!free_[static_cast<std::size_t>(i)] || !free_[static_cast<std::size_t>(j)]) return;
    const int low = std::min(i, j), high = std::max(i, j);
    if (seen == places_.size()) places_.push_back(place(low, high));
    int& at = places_[seen++];
    if (at < begin_[static_cast<std::size_t>(low)] || at >= end(low) ||
        columns_[static_cast<std::size_t>(at)] != high)
      at = place(low, high);
    double* const to = &blocks_[static_cast<std::size_t>(at) * kBlock];
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 3; ++column)
        to[column * kRow + row] += i < j ? block(row, column) : block(column, row);
  };
  matrix_->for_each_pair(std::cref(add), std::cref(add));
  return finish();
}

// Inverts the diagonal and mirrors what is above it.
bool BlockRows::finish() {
  for (int i = 0; i < nodes(); ++i) {
    const int own = own_[static_cast<std::size_t>(i)];
    if (!free_[static_cast<std::size_t>(i)]) continue;
    Mat3 inverse;
    if (!invert(block(own), inverse)) return false;
    put(inverse, &inverses_[static_cast<std::size_t>(i) * kBlock]);
    for (int at = own + 1; at < end(i); ++at) {
      const int mirrored = place(columns_[static_cast<std::size_t>(at)], i);
      put(transposed(block(at)), &blocks_[static_cast<std::size_t>(mirrored) * kBlock]);
    }
  }
  return true;
}

void BlockRows::residual(const double* r, const double* x, double* out) const {
  pool_->run_parts(nodes(), kGrain, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      double sum[kRow] = {};
      for (int at = begin_[static_cast<std::size_t>(i)]; at < this->end(i); ++at)
        add_product(&blocks_[static_cast<std::size_t>(at) * kBlock],
                    x + kRow * columns_[static_cast<std::size_t>(at)], sum);
      for (int k = 0; k < kRow; ++k) out[kRow * i + k] = r[kRow * i + k] - sum[k];
    }
  });
}

void BlockRows::relax(const double* r, double factor, bool add, double* x) const {
  pool_->run_parts(nodes(), kGrain, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      double sum[kRow] = {};
      add_product(&inverses_[static_cast<std::size_t>(i) * kBlock], r + kRow * i, sum);
      for (int k = 0; k < kRow; ++k)
        x[kRow * i + k] = (add ? x[kRow * i + k] : 0) + factor * sum[k];
    }
  });
}

}  // namespace sim
