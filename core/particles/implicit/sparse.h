// Sparse symmetric matrices with a fixed pattern.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace sim {

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

// A symmetric pattern of particles: pairs are the entries off the diagonal, in 3 x 3 blocks.
using ParticlePairs = std::span<const std::array<int, 2>>;

// The number of products that a factorisation takes; rows: those of elimination_rows().
double factor_products(std::span<const int> rows, ParticlePairs pairs);

// The row of each particle in an order of little fill, -1 where pinned (of infinite mass).
// Amestoy, Davis & Duff (1996), SIAM J. Matrix Anal. Appl. 17(4).
std::vector<int> elimination_rows(std::span<const double> masses, ParticlePairs pairs);

}  // namespace sim
