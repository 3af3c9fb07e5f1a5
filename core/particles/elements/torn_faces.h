// The faces of a surface that has been torn.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "core/particles/breakable.h"

namespace sim {

inline bool torn_edge(TornPairs torn, int a, int b) {
  return std::ranges::binary_search(torn, std::array<int, 2>{std::min(a, b), std::max(a, b)});
}

// A face with a torn edge is removed, as it would reach over the gap.
inline bool torn_face(TornPairs torn, const std::array<int, 3>& t) {
  return !torn.empty() && (torn_edge(torn, t[0], t[1]) || torn_edge(torn, t[1], t[2]) ||
                           torn_edge(torn, t[2], t[0]));
}

// The removed faces, and the edges left without a face; both empty if nothing is torn.
struct TornParts {
  std::vector<std::uint8_t> triangles, edges;
};

inline TornParts torn_parts(TornPairs torn, std::span<const std::array<int, 3>> triangles,
                            std::span<const std::array<int, 2>> edges) {
  TornParts gone;
  if (torn.empty()) return gone;
  const auto ordered = [](int a, int b) {
    return std::array<int, 2>{std::min(a, b), std::max(a, b)};
  };
  std::set<std::array<int, 2>> held;  // edges of faces that are there
  for (const auto& t : triangles) {
    gone.triangles.push_back(torn_face(torn, t));
    for (std::size_t k = 0; k < 3 && !gone.triangles.back(); ++k)
      held.insert(ordered(t[k], t[(k + 1) % 3]));
  }
  for (const auto& [a, b] : edges) gone.edges.push_back(!held.contains(ordered(a, b)));
  return gone;
}

}  // namespace sim
