// A matrix of 3 x 3 blocks, assembled row by row.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "block_matrix.h"
#include "core/base/array.h"
#include "core/base/thread_pool.h"
#include "core/linear/sparse.h"

namespace sim {

// The symmetric part of a BlockMatrix over the nodes that are free. Vectors here have four numbers
// a node, the last of them 0. Single precision would be too coarse: a smooth motion stretches next
// to nothing, and its products are small differences of large numbers.
class BlockRows {
 public:
  static constexpr int kRow = 4, kBlock = 3 * kRow;  // numbers of a vector, and of a block

  // All pairs that blocks may couple; free: 0 for nodes without rows.
  BlockRows(const BlockMatrix& matrix, BlockPairs pairs, std::span<const std::uint8_t> free,
            ThreadPool& pool);

  int nodes() const noexcept { return static_cast<int>(own_.size()); }
  // Takes the entries as they are now; false where a block on the diagonal is not positive definite
  // or an entry is not finite.
  bool take();

  // out := r - A x, and x := (add ? x : 0) + factor D^-1 r.
  void residual(const double* r, const double* x, double* out) const;
  void relax(const double* r, double factor, bool add, double* x) const;

  template <class Visit>  // visit(row, column, block) of the diagonal and above it
  void for_each_upper(Visit visit) const {
    for (int i = 0; i < nodes(); ++i)
      for (int at = own_[static_cast<std::size_t>(i)]; at < end(i); ++at)
        visit(i, columns_[static_cast<std::size_t>(at)], block(at));
  }

 private:
  int end(int i) const { return begin_[static_cast<std::size_t>(i) + 1]; }
  int place(int i, int j) const;  // of a block
  Mat3 block(int at) const;
  bool finish();

  const BlockMatrix* matrix_;
  ThreadPool* pool_;
  std::vector<std::uint8_t> free_;
  std::vector<int> begin_, columns_, own_;
  std::vector<int> places_;  // of the blocks of the last time, in their order
  Array blocks_, inverses_;
};

}  // namespace sim
