// A multigrid preconditioner, with iteration counts that hardly grow with the number of particles.
#pragma once

#include <optional>
#include <vector>

#include "aggregate_matrix.h"
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
  int aggregate_index(int i) const { return aggregates_.of[static_cast<std::size_t>(i)]; }
  template <class Visit>  // visit(i) of the particles of a patch
  void each_member(std::size_t aggregate_index, Visit visit) const {
    for (int at = first_[aggregate_index]; at < first_[aggregate_index + 1]; ++at)
      visit(members_[static_cast<std::size_t>(at)]);
  }
  void assign_aggregates();
  void add_particles();
  void add_springs();
  void restrict_rest(const float* rest);
  void add_motions(float* x);

  const StageMatrix* matrix_;
  Layout half_;
  FloatSprings springs_;
  Aggregates aggregates_;
  std::optional<AggregateMatrix> aggregate_matrix_;
  std::vector<int> first_, members_;  // particles of patches
  std::vector<int> places_;           // blocks of springs between two patches, in order
  std::vector<Vec3> arms_;            // of particles, in units of the size of their patch
  Array across_;                      // by particle: part of D by springs to other aggregates
  Array r_, x_;                       // of patches
  ArrayOf<float> rest_, guess_, more_;
};

}  // namespace sim
