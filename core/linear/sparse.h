// Sparse symmetric matrices with a fixed pattern.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace sim {

// A pattern of 3 x 3 blocks: the pairs of nodes, such as particles, off the diagonal.
using BlockPairs = std::span<const std::array<int, 2>>;

// A sparse symmetric matrix and its factors L D L^T (by Eigen), in the order the rows have.
class SparseSymmetric {
 public:
  // `upper`: (row, column) of the entries, row <= column, including the whole diagonal. The pattern
  // is analysed, and I factorised, which takes the memory of all later factorisations (above 16000
  // rows Eigen takes some for its own use).
  SparseSymmetric(int rows, std::span<const std::pair<int, int>> upper);
  ~SparseSymmetric();

  int entry(int row, int column) const;  // its place among the values; in a column they lie by row
  std::span<double> values();
  std::span<const double> values() const;
  bool factorise();                       // the values; false when not positive definite
  bool factorise_indefinite();            // false when a pivot is 0 or not finite
  int negative_pivots() const;            // of D: as many as A has negative eigenvalues (Sylvester)
  void solve(std::span<double> x) const;  // x := A^-1 x

 private:
  struct Matrices;
  std::unique_ptr<Matrices> matrices_;
};

// The number of products that a factorisation in 3 x 3 blocks takes; rows: those of
// elimination_rows().
double factor_products(std::span<const int> rows, BlockPairs pairs);

// The place of each node in an order of little fill. Amestoy, Davis & Duff (1996), SIAM J. Matrix
// Anal. Appl. 17(4).
std::vector<int> little_fill(int nodes, BlockPairs pairs);

// The row of each node in such an order of those of finite mass, -1 for the others.
std::vector<int> elimination_rows(std::span<const double> masses, BlockPairs pairs);

}  // namespace sim
