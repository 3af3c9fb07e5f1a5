// Sets of numbers that are joined two by two.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "core/base/slot.h"

namespace sim {

// Galler and Fischer (1964), with the paths of Tarjan and van Leeuwen (1984) halved on the way.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n = 0) { separate(n); }

  // 0 .. n - 1, each by itself; allocates only where n grows.
  void separate(std::size_t n) {
    parent_.resize(n);
    for (std::size_t i = 0; i < n; ++i) parent_[i] = static_cast<int>(i);
  }
  std::size_t size() const { return parent_.size(); }

  // The least number of the set of i.
  int root(int i) {
    while (parent_[slot(i)] != i) i = parent_[slot(i)] = parent_[slot(parent_[slot(i)])];
    return i;
  }

  void join(int a, int b) {
    const auto [low, high] = std::minmax({root(a), root(b)});
    parent_[slot(high)] = low;
  }
  void join(std::span<const int> all) {
    for (const int each : all) join(all.front(), each);
  }

 private:
  std::vector<int> parent_;
};

}  // namespace sim
