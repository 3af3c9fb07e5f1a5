// The 3 x 3 blocks on the diagonal of a matrix, and their inverses as a preconditioner.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "block_kernels.h"
#include "core/base/array.h"
#include "core/base/layout.h"
#include "core/base/thread_pool.h"
#include "core/math/mat3.h"
#include "core/simd/lanes.h"

namespace sim {

// D, symmetric, and D^-1, by which the residuals of conjugate gradients are preconditioned. A
// vector has three coordinates of every node, in Layout(n, 3). All sums are taken over fixed tiles,
// so that their bits do not depend on threads.
class BlockDiagonal {
 public:
  BlockDiagonal(int n, ThreadPool& pool);

  // The entries xx xy xz yy yz zz of all blocks, to be set before invert().
  std::array<double*, 6> entries() { return pointers(blocks_); }
  Mat3 block(int i) const;
  // The arrays of the entries xx, yy and zz.
  std::array<const double*, 3> trace() const;

  // D^-1 of the nodes [begin, end), multiples of 8; 0 where a node is not free.
  void invert(const std::uint8_t* free, int begin, int end);
  // The inverse of a block on the range of a projection P instead, P (P block P)^-1 P.
  void invert_within(int i, const Mat3& block, const Mat3& projection);

  double multiply(const double* r, double* z);         // z := D^-1 r, returns r.z
  void turn(double beta, const double* z, double* p);  // p := z + beta p
  // d += alpha p, r -= alpha ap, z := D^-1 r, returns r.z.
  double advance(double alpha, const double* p, const double* ap, double* d, double* r, double* z);

  // The sum of what body(begin, end, lanes) adds in eight lanes over all tiles, in a fixed order.
  template <class Body>
  double over_tiles(const Body& body);

 private:
  static constexpr int kTile = 512;  // nodes, fixed, whatever the number of threads
  std::array<double*, 6> pointers(Array& values) const;

  int n_;
  ThreadPool* pool_;
  BlockKernels kernels_ = block_kernels();
  Layout half_, six_;
  Array blocks_, inverses_;
  std::vector<double> tile_sums_;
};

template <class Body>
double BlockDiagonal::over_tiles(const Body& body) {
  pool_->run_parts(static_cast<int>(tile_sums_.size()), 1, [&](int begin, int end) {
    for (int tile = begin; tile < end; ++tile) {
      double lanes[8] = {};
      body(tile * kTile, std::min((tile + 1) * kTile, n_), lanes);
      tile_sums_[static_cast<std::size_t>(tile)] = sum_of(lanes);
    }
  });
  double total = 0;
  for (const double sum : tile_sums_) total += sum;
  return total;
}

}  // namespace sim
