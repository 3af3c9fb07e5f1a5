// Incidence lists: the elements (pairs, triangles, ...) at each particle.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace sim {

// It takes memory for the particles between the lowest and the highest that have elements.
class Incidence {
 public:
  Incidence() = default;
  // n particles; the ids of all elements, one after the other, in [0, n).
  Incidence(int n, std::span<const int> ids);

  // The places of i among the ids, ascending.
  std::span<const int> at(int i) const {
    if (i < begin_ || i >= end()) return {};
    const auto at = static_cast<std::size_t>(i - begin_);
    const auto begin = static_cast<std::size_t>(first_[at]);
    return {places_.data() + begin, static_cast<std::size_t>(first_[at + 1]) - begin};
  }
  // The part of the particles [begin, end) outside of which none has elements.
  std::array<int, 2> within(int begin, int end) const {
    const int from = std::max(begin, begin_);
    return {from, std::max(from, std::min(end, this->end()))};
  }
  int begin() const { return begin_; }
  int end() const { return begin_ + static_cast<int>(first_.size()) - 1; }

 private:
  int begin_ = 0;
  std::vector<int> first_{0}, places_;  // of particle begin_ + i: [first_[i], first_[i + 1])
};

}  // namespace sim
