// Sparse matrices of 3 x 3 blocks that are not symmetric but whose pattern is, and their factors.
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "core/linear/sparse.h"
#include "core/math/mat3.h"

namespace sim {

// A dense block L U, its rows exchanged for the largest pivots (Golub & Van Loan (2013), Matrix
// Computations, section 3.4). Solutions leave a small residual, which an explicit inverse does not.
class PivotedBlock {
 public:
  bool factorise(const Mat3& block);  // false if it is singular or a number is not finite
  Vec3 divide(const Vec3& b) const;

 private:
  Mat3 factors_;  // with the inverses of the pivots
  std::array<std::size_t, 3> row_{0, 1, 2};
};

// A = L U by blocks in a given order, without exchanging blocks, as of a symmetric matrix (George &
// Liu (1981), Computer Solution of Large Sparse Positive Definite Systems). The pattern is analysed
// once.
class PivotedBlockLu {
 public:
  // rows: the place of each node in the order, -1 for one without a row; pairs: nodes with blocks.
  PivotedBlockLu(std::span<const int> rows, BlockPairs pairs);

  int size() const { return static_cast<int>(diagonal_.size()); }
  // Sets all blocks to zero; then they are added to. `pair` of the blocks (a, b) and (b, a).
  void clear();
  Mat3& diagonal(int row) { return diagonal_[static_cast<std::size_t>(row)]; }
  int pair(int low, int high) const;
  Mat3& upper(int pair) { return upper_[static_cast<std::size_t>(pair)]; }
  Mat3& lower(int pair) { return lower_[static_cast<std::size_t>(pair)]; }

  bool factorise();                     // false if a pivot is singular; the blocks are lost
  void solve(std::span<Vec3> x) const;  // x := A^-1 x

 private:
  std::vector<int> begin_, column_;  // of each row, the columns behind the diagonal, ascending
  std::vector<int> target_;          // pairs that elimination changes, in the order of the loops
  std::vector<Mat3> diagonal_, upper_, lower_;
  std::vector<PivotedBlock> pivot_;
};

}  // namespace sim
