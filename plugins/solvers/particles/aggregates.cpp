#include "aggregates.h"

#include <algorithm>

namespace sim {
namespace {

// Edges as (from, to, weight) in the order of nodes; parallel ones are merged.
struct Edge {
  int from, to, weight;
};

WeightedGraph joined(int nodes, std::vector<Edge> edges) {
  std::ranges::sort(edges, [](const Edge& a, const Edge& b) {
    return a.from != b.from ? a.from < b.from : a.to < b.to;
  });
  WeightedGraph graph;
  graph.begin.reserve(static_cast<std::size_t>(nodes) + 1);
  for (std::size_t at = 0; at < edges.size();) {
    const Edge& edge = edges[at];
    while (static_cast<int>(graph.begin.size()) <= edge.from)
      graph.begin.push_back(static_cast<int>(graph.to.size()));
    graph.to.push_back(edge.to);
    graph.weight.push_back(0);
    for (; at < edges.size() && edges[at].from == edge.from && edges[at].to == edge.to; ++at)
      graph.weight.back() += edges[at].weight;
  }
  graph.begin.resize(static_cast<std::size_t>(nodes) + 1, static_cast<int>(graph.to.size()));
  return graph;
}

template <class Visit>  // visit(to, weight)
void at_node(const WeightedGraph& graph, int node, Visit visit) {
  const auto i = static_cast<std::size_t>(node);
  for (int at = graph.begin[i]; at < graph.begin[i + 1]; ++at)
    visit(graph.to[static_cast<std::size_t>(at)], graph.weight[static_cast<std::size_t>(at)]);
}

class Gatherer {
 public:
  Gatherer(const WeightedGraph& graph, std::span<const std::uint8_t> left_out, int wanted)
      : graph_(graph), wanted_(static_cast<std::size_t>(wanted)) {
    const auto n = static_cast<std::size_t>(graph.nodes());
    aggregates_.of.assign(n, kLeft);
    pull_.assign(n, 0);
    for (std::size_t i = 0; i < n; ++i)
      if (left_out[i]) aggregates_.of[i] = -1;
  }

  Aggregates all() {
    for (int node = 0; node < graph_.nodes(); ++node)
      if (of(node) == kLeft) gather_from(node);
    return std::move(aggregates_);
  }

 private:
  static constexpr int kLeft = -2;
  int& of(int node) { return aggregates_.of[static_cast<std::size_t>(node)]; }
  int& pull(int node) { return pull_[static_cast<std::size_t>(node)]; }

  void take(int node) {
    of(node) = aggregates_.count;
    members_.push_back(node);
    at_node(graph_, node, [&](int to, int weight) {
      if (of(to) != kLeft) return;
      if (pull(to) == 0) rim_.push_back(to);
      pull(to) += weight;
    });
  }

  void gather_from(int first) {
    members_.clear();
    rim_.clear();
    take(first);
    while (members_.size() < wanted_ && !rim_.empty()) {
      const auto best = std::ranges::max_element(
          rim_, [&](int a, int b) { return pull(a) != pull(b) ? pull(a) < pull(b) : a > b; });
      const int node = *best;
      rim_.erase(best);
      pull(node) = 0;
      take(node);
    }
    for (const int node : rim_) pull(node) = 0;
    const int other = members_.size() < wanted_ / 2 ? nearest_patch() : -1;
    if (other < 0)
      ++aggregates_.count;
    else
      for (const int member : members_) of(member) = other;
  }

  // The aggregate with the heaviest edge to the current one; -1 if there is none.
  int nearest_patch() {
    int nearest = -1, most = 0;
    for (const int member : members_)
      at_node(graph_, member, [&](int to, int weight) {
        if (of(to) < 0 || of(to) == aggregates_.count || weight <= most) return;
        most = weight;
        nearest = of(to);
      });
    return nearest;
  }

  const WeightedGraph& graph_;
  std::size_t wanted_;
  Aggregates aggregates_;
  std::vector<int> pull_, members_, rim_;  // weights of edges to the patch at hand; around it
};

}  // namespace

WeightedGraph graph_of(int nodes, std::span<const std::array<int, 2>> edges) {
  std::vector<Edge> both;
  both.reserve(2 * edges.size());
  for (const auto& [a, b] : edges) {
    both.push_back({a, b, 1});
    both.push_back({b, a, 1});
  }
  return joined(nodes, std::move(both));
}

Aggregates aggregate(const WeightedGraph& graph, std::span<const std::uint8_t> left_out,
                     int wanted) {
  return Gatherer(graph, left_out, wanted).all();
}

WeightedGraph graph_between(const WeightedGraph& graph, const Aggregates& aggregates) {
  std::vector<Edge> edges;
  for (int node = 0; node < graph.nodes(); ++node) {
    const int from = aggregates.of[static_cast<std::size_t>(node)];
    at_node(graph, node, [&](int to, int weight) {
      const int aggregate_index = aggregates.of[static_cast<std::size_t>(to)];
      if (from >= 0 && aggregate_index >= 0 && from != aggregate_index)
        edges.push_back({from, aggregate_index, weight});
    });
  }
  return joined(aggregates.count, std::move(edges));
}

}  // namespace sim
