#include "block_lu.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

namespace sim {
namespace {

using Block = BlockLu::Block;
constexpr std::size_t kSide = BlockLu::kSize;

// c -= a b.
void subtract_product(const Block& a, const Block& b, Block& c) {
  for (std::size_t i = 0; i < kSide; ++i) {
    double row[kSide];
    for (std::size_t j = 0; j < kSide; ++j) row[j] = c[kSide * i + j];
    for (std::size_t k = 0; k < kSide; ++k)
      for (std::size_t j = 0; j < kSide; ++j) row[j] -= a[kSide * i + k] * b[kSide * k + j];
    for (std::size_t j = 0; j < kSide; ++j) c[kSide * i + j] = row[j];
  }
}

// y -= a x.
void subtract_product(const Block& a, const double* x, double* y) {
  for (std::size_t i = 0; i < kSide; ++i)
    for (std::size_t k = 0; k < kSide; ++k) y[i] -= a[kSide * i + k] * x[k];
}

// a := a^-1 by Gauss and Jordan's elimination with pivots of rows.
bool invert(Block& a) {
  Block inverse = {};
  for (std::size_t k = 0; k < kSide; ++k) inverse[(kSide + 1) * k] = 1;
  for (std::size_t k = 0; k < kSide; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < kSide; ++i)
      if (std::fabs(a[kSide * i + k]) > std::fabs(a[kSide * pivot + k])) pivot = i;
    const double inverse_pivot = 1 / a[kSide * pivot + k];
    if (!std::isfinite(inverse_pivot)) return false;
    for (std::size_t j = 0; j < kSide; ++j) {
      std::swap(a[kSide * k + j], a[kSide * pivot + j]);
      std::swap(inverse[kSide * k + j], inverse[kSide * pivot + j]);
      a[kSide * k + j] *= inverse_pivot;
      inverse[kSide * k + j] *= inverse_pivot;
    }
    for (std::size_t i = 0; i < kSide; ++i) {
      const double factor = a[kSide * i + k];
      if (i == k || factor == 0) continue;
      for (std::size_t j = 0; j < kSide; ++j) {
        a[kSide * i + j] -= factor * a[kSide * k + j];
        inverse[kSide * i + j] -= factor * inverse[kSide * k + j];
      }
    }
  }
  a = inverse;
  return true;
}

}  // namespace

// The order that eliminates a node with the fewest neighbours next, which are then neighbours of
// each other (Tinney & Walker (1967), Proc. IEEE 55, 1801-1809).
void BlockLu::find_order() {
  place_.assign(nodes_, nodes_);
  next_.clear();
  const auto count = [&](std::size_t node) {  // again, if it was counted before
    next_.emplace_back(left_[node].size(), node);
    std::ranges::push_heap(next_, std::greater());
  };
  for (std::size_t i = 0; i < nodes_; ++i) left_[i] = graph_[i], count(i);
  for (std::size_t next = 0; next < nodes_;) {
    const auto [neighbours, node] = next_.front();
    std::ranges::pop_heap(next_, std::greater());
    next_.pop_back();
    if (place_[node] < nodes_ || neighbours != left_[node].size()) continue;
    place_[node] = next++;
    for (const std::size_t i : left_[node]) {
      joined_.clear();
      std::ranges::set_union(left_[i], left_[node], std::back_inserter(joined_));
      std::erase_if(joined_, [&](std::size_t j) { return j == i || j == node; });
      left_[i] = joined_;
      count(i);
    }
  }
}

void BlockLu::analyse(int nodes, std::span<const std::array<int, 2>> pairs) {
  nodes_ = static_cast<std::size_t>(nodes);
  const auto sort = [](std::vector<std::size_t>& list) {
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  // Lists keep their memory for later patterns.
  for (Graph* lists : {&graph_, &left_, &columns_}) {
    if (lists->size() < nodes_) lists->resize(nodes_);
    for (std::size_t i = 0; i < nodes_; ++i) (*lists)[i].clear();
  }
  for (const auto& [a, b] : pairs) {
    graph_[static_cast<std::size_t>(a)].push_back(static_cast<std::size_t>(b));
    graph_[static_cast<std::size_t>(b)].push_back(static_cast<std::size_t>(a));
  }
  for (std::size_t i = 0; i < nodes_; ++i) sort(graph_[i]);
  find_order();
  // The rows of each column of L: those of the matrix, and those of the columns of which it is the
  // first row.
  for (std::size_t i = 0; i < nodes_; ++i)
    for (const std::size_t j : graph_[i])
      if (place_[j] > place_[i]) columns_[place_[i]].push_back(place_[j]);
  begin_.assign(1, 0);
  rows_.clear();
  for (std::size_t k = 0; k < nodes_; ++k) {
    std::vector<std::size_t>& column = columns_[k];
    sort(column);
    rows_.insert(rows_.end(), column.begin(), column.end());
    begin_.push_back(rows_.size());
    if (column.size() > 1)
      columns_[column[0]].insert(columns_[column[0]].end(), column.begin() + 1, column.end());
  }
  targets_.clear();
  for (std::size_t k = 0; k < nodes_; ++k)
    for (std::size_t p = begin_[k]; p < begin_[k + 1]; ++p)
      for (std::size_t q = begin_[k]; q < begin_[k + 1]; ++q)
        targets_.push_back(find(rows_[p], rows_[q]));
  blocks_.resize(nodes_ + 2 * rows_.size());
  x_.resize(kSize * nodes_);
}

std::size_t BlockLu::find(std::size_t row, std::size_t column) const {
  if (row == column) return row;
  const auto [low, high] = std::minmax(row, column);
  const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[low]),
             last = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[low + 1]);
  const auto slot = static_cast<std::size_t>(std::lower_bound(first, last, high) - rows_.begin());
  return row > column ? lower(slot) : upper(slot);
}

void BlockLu::clear() { std::ranges::fill(blocks_, Block{}); }

// Column by column: L_ik = A_ik A_kk^-1, A_ij -= L_ik A_kj. The diagonal becomes its inverse.
bool BlockLu::factorise() {
  const std::size_t* target = targets_.data();
  for (std::size_t k = 0; k < nodes_; ++k) {
    if (!invert(blocks_[k])) return false;
    for (std::size_t p = begin_[k]; p < begin_[k + 1]; ++p) {
      Block product = {};
      subtract_product(blocks_[lower(p)], blocks_[k], product);
      for (std::size_t j = 0; j < product.size(); ++j) blocks_[lower(p)][j] = -product[j];
      for (std::size_t q = begin_[k]; q < begin_[k + 1]; ++q)
        subtract_product(blocks_[lower(p)], blocks_[upper(q)], blocks_[*target++]);
    }
  }
  return true;
}

void BlockLu::solve(std::span<double> x) const {
  for (std::size_t i = 0; i < nodes_; ++i)
    std::copy_n(&x[kSize * i], kSize, &x_[kSize * place_[i]]);
  for (std::size_t k = 0; k < nodes_; ++k)
    for (std::size_t p = begin_[k]; p < begin_[k + 1]; ++p)
      subtract_product(blocks_[lower(p)], &x_[kSize * k], &x_[kSize * rows_[p]]);
  for (std::size_t k = nodes_; k-- > 0;) {
    for (std::size_t p = begin_[k]; p < begin_[k + 1]; ++p)
      subtract_product(blocks_[upper(p)], &x_[kSize * rows_[p]], &x_[kSize * k]);
    double sum[kSize] = {};
    subtract_product(blocks_[k], &x_[kSize * k], sum);
    for (std::size_t j = 0; j < kSize; ++j) x_[kSize * k + j] = -sum[j];
  }
  for (std::size_t i = 0; i < nodes_; ++i)
    std::copy_n(&x_[kSize * place_[i]], kSize, &x[kSize * i]);
}

}  // namespace sim
