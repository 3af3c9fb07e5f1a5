// Aggregation of the nodes of a graph into aggregates of about equal size, for multigrid.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace sim {

// An undirected graph: an edge is listed at both its ends, and weighs as often as it was given.
struct WeightedGraph {
  std::vector<int> begin;  // of the edges of each node, one more at the end
  std::vector<int> to, weight;

  int nodes() const { return static_cast<int>(begin.size()) - 1; }
};

struct Aggregates {
  int count = 0;
  std::vector<int> of;  // of each node; -1: in none
};

WeightedGraph graph_of(int nodes, std::span<const std::array<int, 2>> edges);

// Aggregates of `wanted` nodes each: an aggregate takes in the neighbour with the heaviest edges to
// it, so that it stays round; left-over nodes join a neighbouring aggregate. In the order of the
// nodes.
Aggregates aggregate(const WeightedGraph& graph, std::span<const std::uint8_t> left_out,
                     int wanted);

// The aggregates as nodes, with all edges between two of them as one.
WeightedGraph graph_between(const WeightedGraph& graph, const Aggregates& aggregates);

}  // namespace sim
