#include "core/linear/sparse.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "core/base/assert.h"

namespace sim {

SparseSymmetric::SparseSymmetric(int rows, std::span<const std::pair<int, int>> upper) {
  SIM_ASSERT(std::ranges::all_of(upper, [rows](const auto& entry) {
    return 0 <= entry.first && entry.first <= entry.second && entry.second < rows;
  }));
  std::vector<std::pair<int, int>> entries;
  for (const auto& [row, column] : upper) entries.emplace_back(column, row);
  pattern_ = Sparsity(rows, std::move(entries));
  values_.resize(pattern_.count(), 0);
  factors_ = SupernodalFactors(pattern_);
}

int SparseSymmetric::entry(int row, int column) const {
  const int found = pattern_.find(column, row);
  SIM_ASSERT(found >= 0);
  return found;
}

double factor_products(std::span<const int> rows, BlockPairs pairs) {
  // The factorisation of the graph of nodes, in which every entry stands for a block.
  std::vector<std::pair<int, int>> entries;
  int free = 0;
  for (const int row : rows)
    if (row >= 0) entries.emplace_back(row, row), ++free;
  for (const auto& [a, b] : pairs) {
    const auto [low, high] =
        std::minmax(rows[static_cast<std::size_t>(a)], rows[static_cast<std::size_t>(b)]);
    if (low >= 0) entries.emplace_back(high, low);
  }
  double squares = 0;
  for (const double count : factor_counts(Sparsity(free, std::move(entries))))
    squares += (count + 1) * (count + 1);
  return 27 * squares;
}

std::vector<int> little_fill(int nodes, BlockPairs pairs) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < nodes; ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [a, b] : pairs) {
    entries.emplace_back(a, b, 1.0);
    entries.emplace_back(b, a, 1.0);
  }
  Eigen::SparseMatrix<double> graph(nodes, nodes);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(graph, order);
  std::vector<int> place(static_cast<std::size_t>(nodes));
  for (int k = 0; k < nodes; ++k) place[static_cast<std::size_t>(order.indices()[k])] = k;
  return place;
}

std::vector<int> elimination_rows(std::span<const double> masses, BlockPairs pairs) {
  std::vector<int> rows(masses.size(), -1);
  int free = 0;
  for (std::size_t i = 0; i < masses.size(); ++i)
    if (masses[i] < HUGE_VAL) rows[i] = free++;
  if (free == 0) return rows;

  std::vector<std::array<int, 2>> between;  // free nodes
  for (const auto& [a, b] : pairs) {
    const int row = rows[static_cast<std::size_t>(a)], col = rows[static_cast<std::size_t>(b)];
    if (row >= 0 && col >= 0) between.push_back({row, col});
  }
  const std::vector<int> place = little_fill(free, between);
  for (int& row : rows)
    if (row >= 0) row = place[static_cast<std::size_t>(row)];
  return rows;
}

}  // namespace sim
