// Incidence lists: the elements (pairs, triangles, ...) at each particle.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace sim {

class Incidence {
 public:
  Incidence() = default;
  // n particles; the ids of all elements, one after the other, in [0, n).
  Incidence(int n, std::span<const int> ids);

  // The places of i among the ids, ascending.
  std::span<const int> at(int i) const {
    if (static_cast<std::size_t>(i) + 1 >= first_.size()) return {};
    const auto begin = static_cast<std::size_t>(first_[static_cast<std::size_t>(i)]);
    const auto end = static_cast<std::size_t>(first_[static_cast<std::size_t>(i) + 1]);
    return {places_.data() + begin, end - begin};
  }

 private:
  std::vector<int> first_, places_;  // of particle i: [first_[i], first_[i + 1])
};

}  // namespace sim
