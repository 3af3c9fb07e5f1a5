// Neighbours of a graph put together to patches of about equal size.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace sim {

// Undirected: an edge stands at both its ends, and weighs as often as it was given.
struct PatchGraph {
  std::vector<int> begin;  // of the edges of each node, one more at the end
  std::vector<int> to, weight;

  int nodes() const { return static_cast<int>(begin.size()) - 1; }
};

struct Patches {
  int count = 0;
  std::vector<int> of;  // of each node; -1: in none
};

PatchGraph graph_of(int nodes, std::span<const std::pair<int, int>> edges);

// Of `wanted` nodes each: a patch takes in whatever neighbour has the heaviest edges to it, so that
// it stays round; what is then left between others joins one of them. In the order of the nodes.
Patches gather_patches(const PatchGraph& graph, std::span<const std::uint8_t> left_out, int wanted);

// The patches as nodes, with all edges between two of them as one.
PatchGraph graph_between(const PatchGraph& graph, const Patches& patches);

}  // namespace sim
