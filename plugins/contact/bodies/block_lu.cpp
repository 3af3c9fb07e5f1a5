#include "block_lu.h"

#include <algorithm>
#include <functional>
#include <iterator>

namespace sim {

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
  x_.resize(kStride * nodes_);
}

std::size_t BlockLu::find(std::size_t row, std::size_t column) const {
  if (row == column) return row;
  const auto [low, high] = std::minmax(row, column);
  const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[low]),
             last = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[low + 1]);
  const auto slot = static_cast<std::size_t>(std::lower_bound(first, last, high) - rows_.begin());
  const LuBlocks places{nodes_};
  return row > column ? places.lower(slot) : places.upper(slot);
}

void BlockLu::clear() { std::ranges::fill(blocks_, LuBlock{}); }

LuBlocks BlockLu::factors() {
  return {nodes_, begin_.data(), rows_.data(), targets_.data(), blocks_.data()};
}

bool BlockLu::factorise() { return kernels_.factorise(factors()); }

void BlockLu::solve(std::span<double> x) {
  const auto copy = [](const double* from, double* to) { std::copy_n(from, kStride, to); };
  for (std::size_t i = 0; i < nodes_; ++i) copy(&x[kStride * i], &x_[kStride * place_[i]]);
  kernels_.solve(factors(), x_.data());
  for (std::size_t i = 0; i < nodes_; ++i) copy(&x_[kStride * place_[i]], &x[kStride * i]);
}

}  // namespace sim
