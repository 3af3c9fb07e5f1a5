#include "core/particles/constraints/saddle_order.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim {

SaddleOrder saddle_order(const Constraints& constraints, BlockPairs pairs) {
  const RowPattern& pattern = constraints.rows().pattern;
  const std::span<const double> weights = constraints.weights();
  std::vector<double> masses(weights.size(), HUGE_VAL);
  for (std::size_t i = 0; i < masses.size(); ++i)
    if (weights[i] > 0) masses[i] = 1 / weights[i];
  std::vector<std::array<int, 2>> joined(pairs.begin(), pairs.end());
  for (int r = 0; r < pattern.rows(); ++r)
    for (const int a : pattern.of(r))
      for (const int b : pattern.of(r))
        if (a < b) joined.push_back({a, b});
  const std::vector<int> order = elimination_rows(masses, joined);

  std::vector<int> particle_in(weights.size(), -1);
  std::vector<std::vector<int>> rows_behind(weights.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    if (order[i] >= 0) particle_in[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
  for (int r = 0; r < pattern.rows(); ++r) {
    int last = -1;
    for (const int i : pattern.of(r)) last = std::max(last, order[static_cast<std::size_t>(i)]);
    if (last >= 0) rows_behind[static_cast<std::size_t>(last)].push_back(r);
  }
  SaddleOrder found;
  found.particle_at.assign(weights.size(), -1);
  found.row_at.assign(static_cast<std::size_t>(pattern.rows()), -1);
  for (std::size_t k = 0; k < particle_in.size() && particle_in[k] >= 0; ++k) {
    found.particle_at[static_cast<std::size_t>(particle_in[k])] =
        std::exchange(found.unknowns, found.unknowns + 3);
    for (const int r : rows_behind[k]) found.row_at[static_cast<std::size_t>(r)] = found.unknowns++;
  }
  return found;
}

}  // namespace sim
