// Symmetric block matrices over the rigid-body modes of aggregates: the coarse levels of multigrid.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "aggregates.h"
#include "core/base/array.h"
#include "core/linear/sparse.h"
#include "core/math/vec3.h"

namespace sim {

// The motion of an aggregate is velocity = u + w x arm, with arm in units of its size, stored as
// (u, w). A vector has eight numbers an aggregate, the last two 0; a block has six columns of
// eight.
struct AggregateKernels {
  static constexpr int kRow = 8, kBlock = 6 * kRow;
  // out_i := r_i - sum_j B_ij x_j
  void (*residual)(const WeightedGraph& pattern, const float* blocks, const double* r,
                   const double* x, double* out, int begin, int end);
  // x_i := (add ? x_i : 0) + factor C_i r_i with the blocks C.
  void (*relax)(const float* blocks, double factor, const double* r, double* x, bool add, int begin,
                int end);
};

AggregateKernels aggregate_kernels();  // for this machine

// B x = r, solved approximately by smoothing and by the same on fewer, larger aggregates, and in
// the end directly: W cycles of multigrid with rigid-body modes. Vanek, Mandel & Brezina (1996),
// Computing 56, 179-196; Tamstorf, Jones & McCormick (2015), ACM TOG 34(6) 245; all memory is its
// own.
class AggregateMatrix {
 public:
  // How large the eigenvalues of D^-1 B are: 2 at most for springs, each of which is added to both
  // its ends; power iteration tells for others.
  enum class Spectrum { kSprings, kEstimated };
  // B_ij for the edges; the diagonal is always included. The finest level takes most of the time,
  // and may smooth less: by one step instead of two.
  AggregateMatrix(const WeightedGraph& between, int steps, Spectrum spectrum);

  int count() const noexcept { return pattern_.nodes(); }
  std::vector<Vec3>& centres() noexcept { return centres_; }  // m; to be set before the blocks
  std::vector<double>& sizes() noexcept { return sizes_; }
  int place(int i, int j) const;  // of a block
  double* block(int place) { return &blocks_[static_cast<std::size_t>(place) * kBlock]; }
  double* own(int i) { return block(own_[static_cast<std::size_t>(i)]); }
  void clear();  // all blocks

  // Called after the blocks i <= j are set; the others need not be. False if not positive definite.
  bool prepare();
  void solve(const double* r, double* x);  // x := about B^-1 r, a fixed symmetric map

 private:
  static constexpr int kBlock = AggregateKernels::kBlock, kRow = AggregateKernels::kRow;
  void make_coarser(const WeightedGraph& between);
  void place_coarser();
  void mirror();
  bool invert_own();
  double largest_eigenvalue();
  bool prepare_coarser();
  bool factorise();
  void solve_directly(const double* r, double* x);
  void smooth(const double* r, double* x, bool from_zero);
  void correct(const double* r, double* x);

  AggregateKernels kernels_ = aggregate_kernels();
  Spectrum spectrum_;
  std::vector<double> steps_;  // of smoothing, how far each goes
  WeightedGraph pattern_;
  std::vector<int> own_, mirror_;
  Array blocks_, rest_;
  Array none_, trial_;                 // 0, and a vector of power iteration
  ArrayOf<float> narrow_, inverses_;   // all blocks; the inverses of those on the diagonal
  std::vector<Vec3> centres_, arms_;   // arms: in the coarser patch, in units of its size
  std::vector<double> sizes_, turns_;  // turns: this size in units of the coarser one

  Aggregates aggregates_;
  std::unique_ptr<AggregateMatrix> coarser_;
  std::vector<int> place_in_coarser_;  // of each block, -1 where its mirror image counts
  Array r_, x_, again_;                // of the coarser one
  std::optional<SparseSymmetric> factor_;
  std::vector<double> direct_;
};

}  // namespace sim
