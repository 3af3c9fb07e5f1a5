// Blocks of 6 x 6 numbers, several numbers at a time.
#pragma once

#include <cstddef>

namespace sim {

constexpr std::size_t kBlockSize = 6;
constexpr std::size_t kBlockStride = 8;  // of columns, and of vectors: zeros follow, for the lanes

// A block by columns.
struct alignas(64) LuBlock {
  double numbers[kBlockSize * kBlockStride];
  double& operator()(std::size_t i, std::size_t j) { return numbers[kBlockStride * j + i]; }
  double operator()(std::size_t i, std::size_t j) const { return numbers[kBlockStride * j + i]; }
};

// A matrix of blocks, with places for its factors: the blocks of the diagonal, then pairs of one
// below and one above it, by the columns of the one below.
struct LuBlocks {
  std::size_t nodes = 0;
  const std::size_t *begin = nullptr, *rows = nullptr;  // of each column's pairs, ascending
  const std::size_t* targets = nullptr;  // of the products, in the order in which they are made
  LuBlock* blocks = nullptr;

  std::size_t lower(std::size_t pair) const { return nodes + 2 * pair; }
  std::size_t upper(std::size_t pair) const { return nodes + 2 * pair + 1; }
};

struct BlockLuKernels {
  // A := its factors, L below the diagonal, U above it, and the inverses of the pivots on it; false
  // if one is singular.
  bool (*factorise)(const LuBlocks& a);
  // x := A^-1 x by factors.
  void (*solve)(const LuBlocks& factors, double* x);
  // block += sum_k rows[k]^T products[k].
  void (*add_product)(const double (&rows)[3][kBlockStride],
                      const double (&products)[3][kBlockStride], LuBlock& block);
};

BlockLuKernels block_lu_kernels();  // for this machine

}  // namespace sim
