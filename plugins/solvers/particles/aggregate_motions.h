// Rigid motions of aggregates of nodes: the map between nodes and the coarse levels of multigrid.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "aggregate_matrix.h"
#include "aggregates.h"
#include "core/math/vec3.h"

namespace sim {

// P maps the motion (u, w) of an aggregate to the velocities u + w x arm of its nodes, with arms in
// units of its size, so that all columns of P have the same scale.
class AggregateMotions {
 public:
  // About `wanted` nodes an aggregate; those that are pinned are in none.
  AggregateMotions(const WeightedGraph& graph, std::span<const std::uint8_t> pinned, int wanted);

  const Aggregates& aggregates() const noexcept { return aggregates_; }
  int count() const noexcept { return aggregates_.count; }
  int of(int node) const { return aggregates_.of[static_cast<std::size_t>(node)]; }
  const Vec3& arm(int node) const { return arms_[static_cast<std::size_t>(node)]; }
  template <class Visit>  // visit(node) of the nodes of an aggregate
  void each_member(int aggregate, Visit visit) const {
    const auto p = static_cast<std::size_t>(aggregate);
    for (int at = first_[p]; at < first_[p + 1]; ++at)
      visit(members_[static_cast<std::size_t>(at)]);
  }

  // Finds the arms, and puts centres and sizes into the matrix; at(node) is a position.
  template <class Position>
  void place(Position at, AggregateMatrix& matrix);

  // Adds P^T y at a node to a column of a block, or to a part of a vector over aggregates.
  static void add_transposed(const Vec3& arm, const Vec3& y, double* column);
  // Column `column` of P at a node.
  static Vec3 motion(const Vec3& arm, int column);

  // to := P^T r, with r(node) a vector.
  template <class Residual>
  void restrict(Residual r, double* to) const;
  // Calls add(node, velocity) for P x.
  template <class Add>
  void prolong(const double* x, Add add) const;

 private:
  static constexpr int kRow = AggregateKernels::kRow;
  Aggregates aggregates_;
  std::vector<int> first_, members_;  // nodes of aggregates
  std::vector<Vec3> arms_;            // of nodes
};

template <class Position>
void AggregateMotions::place(Position at, AggregateMatrix& matrix) {
  for (int p = 0; p < count(); ++p) {
    Vec3 centre = Vec3::Zero();
    double size = 0;
    int nodes = 0;
    each_member(p, [&](int i) { centre += at(i), ++nodes; });
    centre = centre / nodes;
    each_member(p, [&](int i) {
      Vec3& arm = arms_[static_cast<std::size_t>(i)];
      arm = at(i) - centre;
      size = std::max(size, arm.norm());
    });
    each_member(p, [&](int i) {
      Vec3& arm = arms_[static_cast<std::size_t>(i)];
      arm = size > 0 ? Vec3(arm / size) : Vec3::Zero();
    });
    matrix.centres()[static_cast<std::size_t>(p)] = centre;
    matrix.sizes()[static_cast<std::size_t>(p)] = size;
  }
}

template <class Residual>
void AggregateMotions::restrict(Residual r, double* to) const {
  for (int p = 0; p < count(); ++p) {
    Vec3 sum = Vec3::Zero(), turn = Vec3::Zero();
    each_member(p, [&](int i) {
      const Vec3 at = r(i);
      sum += at;
      turn += arm(i).cross(at);
    });
    double* const row = to + p * kRow;
    for (std::size_t k = 0; k < 3; ++k) row[k] = sum[k], row[3 + k] = turn[k];
  }
}

template <class Add>
void AggregateMotions::prolong(const double* x, Add add) const {
  for (int p = 0; p < count(); ++p) {
    const double* const from = x + p * kRow;
    const Vec3 u(from[0], from[1], from[2]), w(from[3], from[4], from[5]);
    each_member(p, [&](int i) { add(i, u + w.cross(arm(i))); });
  }
}

}  // namespace sim
