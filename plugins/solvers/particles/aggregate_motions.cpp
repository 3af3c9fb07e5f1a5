#include "aggregate_motions.h"

namespace sim {

AggregateMotions::AggregateMotions(const WeightedGraph& graph, std::span<const std::uint8_t> pinned,
                                   int wanted)
    : aggregates_(aggregate(graph, pinned, wanted)), arms_(aggregates_.of.size()) {
  first_.assign(static_cast<std::size_t>(aggregates_.count) + 1, 0);
  for (const int aggregate : aggregates_.of)
    if (aggregate >= 0) ++first_[static_cast<std::size_t>(aggregate) + 1];
  for (std::size_t p = 1; p < first_.size(); ++p) first_[p] += first_[p - 1];
  members_.resize(static_cast<std::size_t>(first_.back()));
  std::vector<int> next(first_.begin(), first_.end());
  for (std::size_t i = 0; i < aggregates_.of.size(); ++i)
    if (const int aggregate = aggregates_.of[i]; aggregate >= 0)
      members_[static_cast<std::size_t>(next[static_cast<std::size_t>(aggregate)]++)] =
          static_cast<int>(i);
}

// P = [I, -[arm]x]
Vec3 AggregateMotions::motion(const Vec3& arm, int column) {
  switch (column) {
    case 3:
      return {0, -arm[2], arm[1]};
    case 4:
      return {arm[2], 0, -arm[0]};
    case 5:
      return {-arm[1], arm[0], 0};
    default:
      return {column == 0 ? 1.0 : 0.0, column == 1 ? 1.0 : 0.0, column == 2 ? 1.0 : 0.0};
  }
}

void AggregateMotions::add_transposed(const Vec3& arm, const Vec3& y, double* column) {
  const Vec3 turn = arm.cross(y);
  for (std::size_t k = 0; k < 3; ++k) {
    column[k] += y[k];
    column[3 + k] += turn[k];
  }
}

}  // namespace sim
