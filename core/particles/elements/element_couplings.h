// The pairs of particles that elements couple.
#pragma once

#include <array>
#include <span>
#include <vector>

namespace sim {

// Appends every pair of particles that share an element; `ids`: the particles of one element after
// the other, `arity` of each.
inline void add_element_couplings(std::span<const int> ids, int arity,
                                  std::vector<std::array<int, 2>>& pairs) {
  const auto size = static_cast<std::size_t>(arity);
  for (std::size_t element = 0; element + size <= ids.size(); element += size)
    for (std::size_t a = 0; a < size; ++a)
      for (std::size_t b = a + 1; b < size; ++b)
        pairs.push_back({ids[element + a], ids[element + b]});
}

}  // namespace sim
