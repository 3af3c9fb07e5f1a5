#include "core/particles/implicit/sparse.h"

#include <Eigen/OrderingMethods>
#include <cmath>

namespace sim {

std::vector<int> elimination_rows(std::span<const double> masses,
                                  std::span<const std::pair<int, int>> pairs) {
  std::vector<int> rows(masses.size(), -1);
  int free = 0;
  for (std::size_t i = 0; i < masses.size(); ++i)
    if (masses[i] < HUGE_VAL) rows[i] = free++;
  if (free == 0) return rows;

  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < free; ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [a, b] : pairs) {
    const int row = rows[static_cast<std::size_t>(a)], col = rows[static_cast<std::size_t>(b)];
    if (row < 0 || col < 0) continue;
    entries.emplace_back(row, col, 1.0);
    entries.emplace_back(col, row, 1.0);
  }
  Eigen::SparseMatrix<double> graph(free, free);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(graph, order);
  const Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> place = order.inverse();
  for (int& row : rows)
    if (row >= 0) row = place.indices()[row];
  return rows;
}

}  // namespace sim
