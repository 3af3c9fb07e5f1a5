// Multigrid for matrices of any blocks, such as those of elastic solids.
#pragma once

#include <optional>

#include "aggregate_matrix.h"
#include "aggregate_motions.h"
#include "block_rows.h"
#include "linear_solver.h"
#include "stage_matrix.h"

namespace sim {

// A V cycle as that of Multigrid, for blocks that are no springs: smoothing by Chebyshev
// polynomials of D^-1 A, whose largest eigenvalue is estimated by power iteration. Adams, Brezina,
// Hu & Tuminaro (2003), J. Comput. Phys. 188(2), 593-610.
class BlockMultigrid final : public Preconditioner {
 public:
  // All pairs that blocks may couple.
  BlockMultigrid(const StageMatrix& matrix, const Particles& system, BlockPairs pairs);

  bool prepare() override;
  double solve(const double* r, double* z) override;

 private:
  static constexpr int kSteps = 2;  // of smoothing
  void smooth(bool from_zero);
  double largest_eigenvalue();

  const StageMatrix* matrix_;
  BlockRows rows_;
  std::optional<AggregateMotions> motions_;
  std::optional<AggregateMatrix> coarse_;
  double steps_[kSteps];
  Array r_, x_;  // of aggregates
  Array right_, guess_, rest_;
};

}  // namespace sim
