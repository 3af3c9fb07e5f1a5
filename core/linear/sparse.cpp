#include "core/linear/sparse.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "core/base/assert.h"

namespace sim {

struct SparseSymmetric::Matrices {
  // Eigen's factorisation without its copies.
  class Ldlt : public Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper,
                                            Eigen::NaturalOrdering<int>> {
   public:
    bool factorise(const Eigen::SparseMatrix<double>& upper) {
      factorize_preordered<true>(upper);
      return info() == Eigen::Success && m_diag.allFinite();
    }
    bool positive() const { return m_diag.minCoeff() > 0; }
    int negative() const { return static_cast<int>((m_diag.array() < 0).count()); }
    void solve_in_place(Eigen::Map<Eigen::VectorXd> x) const {
      matrixL().solveInPlace(x);
      x.array() /= m_diag.array();
      matrixU().solveInPlace(x);
    }
  };

  Eigen::SparseMatrix<double> upper;
  Ldlt ldlt;
};

SparseSymmetric::SparseSymmetric(int rows, std::span<const std::pair<int, int>> upper)
    : matrices_(std::make_unique<Matrices>()) {
  std::vector<Eigen::Triplet<double>> entries;
  SIM_ASSERT(std::ranges::all_of(upper, [rows](const auto& entry) {
    return 0 <= entry.first && entry.first <= entry.second && entry.second < rows;
  }));
  for (const auto& [row, column] : upper) entries.emplace_back(row, column, 0.0);
  matrices_->upper.resize(rows, rows);
  matrices_->upper.setFromTriplets(entries.begin(), entries.end());
  matrices_->upper.makeCompressed();
  if (rows == 0) return;
  matrices_->ldlt.analyzePattern(matrices_->upper);
  for (int row = 0; row < rows; ++row) values()[static_cast<std::size_t>(entry(row, row))] = 1;
  factorise();
}

SparseSymmetric::~SparseSymmetric() = default;

int SparseSymmetric::entry(int row, int column) const {
  const int* const rows = matrices_->upper.innerIndexPtr();
  const int* const columns = matrices_->upper.outerIndexPtr();
  const int* const found =
      std::lower_bound(rows + columns[column], rows + columns[column + 1], row);
  SIM_ASSERT(found != rows + columns[column + 1] && *found == row);
  return static_cast<int>(found - rows);
}

std::span<double> SparseSymmetric::values() {
  return {matrices_->upper.valuePtr(), static_cast<std::size_t>(matrices_->upper.nonZeros())};
}

std::span<const double> SparseSymmetric::values() const {
  return {matrices_->upper.valuePtr(), static_cast<std::size_t>(matrices_->upper.nonZeros())};
}

bool SparseSymmetric::factorise() {
  return matrices_->ldlt.factorise(matrices_->upper) && matrices_->ldlt.positive();
}

bool SparseSymmetric::factorise_indefinite() { return matrices_->ldlt.factorise(matrices_->upper); }

int SparseSymmetric::negative_pivots() const { return matrices_->ldlt.negative(); }

void SparseSymmetric::solve(std::span<double> x) const {
  SIM_ASSERT(static_cast<Eigen::Index>(x.size()) == matrices_->upper.rows());
  matrices_->ldlt.solve_in_place({x.data(), static_cast<Eigen::Index>(x.size())});
}

double factor_products(std::span<const int> rows, BlockPairs pairs) {
  // The factorisation of the graph of nodes, in which every entry stands for a block.
  class Counts : public Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper,
                                              Eigen::NaturalOrdering<int>> {
   public:
    double squares() const { return (m_nonZerosPerCol.cast<double>().array() + 1).square().sum(); }
  };
  std::vector<Eigen::Triplet<double>> entries;
  int free = 0;
  for (const int row : rows)
    if (row >= 0) entries.emplace_back(row, row, 1.0), ++free;
  for (const auto& [a, b] : pairs) {
    const auto [low, high] =
        std::minmax(rows[static_cast<std::size_t>(a)], rows[static_cast<std::size_t>(b)]);
    if (low >= 0) entries.emplace_back(low, high, 1.0);
  }
  if (free == 0) return 0;
  Eigen::SparseMatrix<double> graph(free, free);
  graph.setFromTriplets(entries.begin(), entries.end());
  Counts counts;
  counts.analyzePattern(graph);
  return 27 * counts.squares();
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
