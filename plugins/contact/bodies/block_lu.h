// Sparse matrices of 6 x 6 blocks, such as of rigid bodies, with a symmetric pattern.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace sim {

// The factors L U of a matrix that need not be symmetric, block by block in an order of little
// fill, with pivots inside the blocks of the diagonal alone.
class BlockLu {
 public:
  static constexpr std::size_t kSize = 6;
  using Block = std::array<double, kSize * kSize>;  // by rows

  // Analyses the pattern; pairs: of nodes, off the diagonal.
  void analyse(int nodes, std::span<const std::array<int, 2>> pairs);
  std::size_t products() const { return targets_.size(); }  // of blocks, a factorisation

  void clear();                                   // all entries
  std::size_t entry(int row, int column) const {  // its place among the blocks
    return find(place_[static_cast<std::size_t>(row)], place_[static_cast<std::size_t>(column)]);
  }
  Block& block(std::size_t entry) { return blocks_[entry]; }
  bool factorise();                       // false if a pivot is singular
  void solve(std::span<double> x) const;  // x := A^-1 x

 private:
  using Graph = std::vector<std::vector<std::size_t>>;
  void find_order();
  std::size_t lower(std::size_t slot) const { return nodes_ + 2 * slot; }
  std::size_t upper(std::size_t slot) const { return nodes_ + 2 * slot + 1; }
  std::size_t find(std::size_t row, std::size_t column) const;

  std::size_t nodes_ = 0;
  std::vector<std::size_t> place_;         // of each node in the order of elimination
  std::vector<std::size_t> begin_, rows_;  // of each column those below the diagonal, ascending
  std::vector<std::size_t> targets_;       // of the products, in the order in which they are made
  std::vector<Block> blocks_;              // the diagonal, then pairs below and above it
  mutable std::vector<double> x_;
  // The analysis keeps neighbours, ascending, those left by an elimination, and rows of columns.
  Graph graph_, left_, columns_;
  std::vector<std::size_t> joined_;
  std::vector<std::pair<std::size_t, std::size_t>> next_;  // neighbours and nodes, a heap
};

}  // namespace sim
