// Sparse matrices of 6 x 6 blocks, such as of rigid bodies, with a symmetric pattern.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "block_lu_kernels.h"

namespace sim {

// The factors L U of a matrix that need not be symmetric, block by block in an order of little
// fill, with pivots inside the blocks of the diagonal alone.
class BlockLu {
 public:
  static constexpr std::size_t kSize = kBlockSize, kStride = kBlockStride;

  // Analyses the pattern; pairs: of nodes, off the diagonal.
  void analyse(int nodes, std::span<const std::array<int, 2>> pairs);
  std::size_t products() const { return targets_.size(); }  // of blocks, a factorisation

  void clear();                                   // all entries
  std::size_t entry(int row, int column) const {  // its place among the blocks
    return find(place_[static_cast<std::size_t>(row)], place_[static_cast<std::size_t>(column)]);
  }
  LuBlock& block(std::size_t entry) { return blocks_[entry]; }
  // block += sum_k rows[k]^T products[k].
  void add_product(std::size_t entry, const double (&rows)[3][kStride],
                   const double (&products)[3][kStride]) {
    kernels_.add_product(rows, products, blocks_[entry]);
  }
  bool factorise();                 // false if a pivot is singular
  void solve(std::span<double> x);  // x := A^-1 x, kStride numbers a node

 private:
  using Graph = std::vector<std::vector<std::size_t>>;
  void find_order();
  LuBlocks factors();
  std::size_t find(std::size_t row, std::size_t column) const;

  std::size_t nodes_ = 0;
  std::vector<std::size_t> place_;         // of each node in the order of elimination
  std::vector<std::size_t> begin_, rows_;  // of each column those below the diagonal, ascending
  std::vector<std::size_t> targets_;       // of the products, in the order in which they are made
  std::vector<LuBlock> blocks_;            // see LuBlocks
  std::vector<double> x_;
  BlockLuKernels kernels_ = block_lu_kernels();
  // The analysis keeps neighbours, ascending, those left by an elimination, and rows of columns.
  Graph graph_, left_, columns_;
  std::vector<std::size_t> joined_;
  std::vector<std::pair<std::size_t, std::size_t>> next_;  // neighbours and nodes, a heap
};

}  // namespace sim
