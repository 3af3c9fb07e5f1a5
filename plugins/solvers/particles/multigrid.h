// A multigrid preconditioner, with iteration counts that hardly grow with the number of particles.
#pragma once

#include <optional>
#include <vector>

#include "aggregate_matrix.h"
#include "aggregate_motions.h"
#include "float_springs.h"
#include "linear_solver.h"

namespace sim {

// A V cycle: a damped Jacobi step with the blocks on the diagonal, the same problem for aggregates
// of about 36 neighbours along springs that move as rigid bodies (AggregateMatrix), and another
// Jacobi step. The error modes that are slow for conjugate gradients stretch next to no spring, so
// they are rigid motions of aggregates. The steps on particles run in single precision, those on
// aggregates in double: their matrix is small where they move as one, a difference of large
// numbers.
class Multigrid final : public Preconditioner {
 public:
  Multigrid(const StageMatrix& matrix, const Particles& system);

  bool prepare() override;
  double solve(const double* r, double* z) override;

 private:
  static constexpr int kRow = AggregateKernels::kRow;
  void add_particles();
  void add_springs();

  const StageMatrix* matrix_;
  Layout half_;
  FloatSprings springs_;
  std::optional<AggregateMotions> motions_;
  std::optional<AggregateMatrix> aggregate_matrix_;
  std::vector<int> places_;  // blocks of springs between two aggregates, in order
  Array across_;             // by particle: part of D by springs to other aggregates
  Array r_, x_;              // of aggregates
  ArrayOf<float> rest_, guess_, more_;
};

}  // namespace sim
