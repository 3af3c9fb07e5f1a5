// What is slow for conjugate gradients, and solved directly: patches that move as rigid bodies.
#pragma once

#include <optional>
#include <vector>

#include "core/particles/implicit/sparse.h"
#include "core/particles/implicit/stage_matrix.h"

namespace sim {

// Particles are put together to patches of neighbours along springs, of some sqrt(n) / 2 each. P
// has for each patch its three translations and three rotations, which stretch no spring within it:
// A_c = P^T A P is small, and P A_c^-1 P^T together with the blocks on the diagonal leaves few
// iterations, whose number hardly grows with n. Aggregation with rigid-body modes: Vanek, Mandel &
// Brezina (1996), Computing 56, 179-196; Tamstorf, Jones & McCormick (2015), ACM TOG 34(6) 245.
class CoarseSpace {
 public:
  // masses of the particles in kg, infinity where pinned.
  CoarseSpace(const StageMatrix& matrix, std::span<const double> masses);

  // For the matrix as it is now; false when A_c is not positive definite.
  bool factorise(const StageMatrix& matrix);

  // z += P A_c^-1 P^T r; what that adds to r.z.
  double correct(const double* r, double* z);

 private:
  using Pairs = std::vector<std::pair<int, int>>;
  struct Target {
    int column[6];  // where in the values the block's part of each of six columns begins
  };
  void gather_patches(const Pairs& pairs, std::span<const double> masses);
  void place_patches(const StageMatrix& matrix);
  Target target(int low, int high) const;
  int patch(int i) const { return patch_of_[static_cast<std::size_t>(i)]; }

  Layout layout_;
  int patches_ = 0;
  std::vector<int> patch_of_, row_of_;      // of particles, -1 where pinned; of patches
  std::vector<Vec3> arm_, centre_;          // of particles, in units of its patch; of patches
  std::vector<double> size_;                // of patches, m
  std::vector<int> count_;                  // particles of patches
  std::vector<Target> diagonal_, springs_;  // of patches; of springs between two of them
  std::optional<SparseSymmetric> upper_;
  std::vector<double> coarse_, copy_;
};

}  // namespace sim
