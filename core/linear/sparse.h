// Sparse symmetric matrices with a fixed pattern.
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "core/linear/supernodal.h"
#include "core/math/sparsity.h"

namespace sim {

// A pattern of 3 x 3 blocks: the pairs of nodes, such as particles, off the diagonal.
using BlockPairs = std::span<const std::array<int, 2>>;

// A sparse symmetric matrix and its factors L D L^T, in the order the rows have.
class SparseSymmetric {
 public:
  // `upper`: (row, column) of the entries, row <= column, including the whole diagonal. The pattern
  // is analysed, which takes the memory of all factorisations.
  SparseSymmetric(int rows, std::span<const std::pair<int, int>> upper);

  int entry(int row, int column) const;  // its place among the values; in a column they lie by row
  int column(int column) const { return pattern_.begin_of(column); }  // its first entry
  std::span<double> values() { return values_; }
  std::span<const double> values() const { return values_; }
  bool factorise() { return factors_.factorise(values_, true); }  // false: not positive definite
  // False when a pivot is 0 or not finite.
  bool factorise_indefinite() { return factors_.factorise(values_, false); }
  // Pivots below 0 are as many as negative eigenvalues of A (Sylvester).
  int negative_pivots() const { return factors_.negative_pivots(); }
  void solve(std::span<double> x) const { factors_.solve(x); }  // x := A^-1 x; one thread at a time

 private:
  Sparsity pattern_;
  std::vector<double> values_;
  SupernodalFactors factors_;
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
