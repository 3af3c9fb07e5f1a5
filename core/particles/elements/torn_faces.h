// The faces of a surface that has been torn.
#pragma once

#include <algorithm>
#include <array>
#include <span>

namespace sim {

using TornPairs = std::span<const std::array<int, 2>>;  // of Force::tear()

inline bool torn_edge(TornPairs torn, int a, int b) {
  return std::ranges::binary_search(torn, std::array<int, 2>{std::min(a, b), std::max(a, b)});
}

// A face with a torn edge is gone: it would reach over the gap.
inline bool torn_face(TornPairs torn, const std::array<int, 3>& t) {
  return !torn.empty() && (torn_edge(torn, t[0], t[1]) || torn_edge(torn, t[1], t[2]) ||
                           torn_edge(torn, t[2], t[0]));
}

}  // namespace sim
