// A preconditioner whose iterations hardly grow in number with the particles.
#pragma once

#include <optional>
#include <vector>

#include "core/particles/implicit/rigid_matrix.h"
#include "core/particles/implicit/single_springs.h"

namespace sim {

// A V cycle: a damped Jacobi step with the blocks on the diagonal, the same problem for patches of
// some 36 neighbours along springs that move as rigid bodies (RigidMatrix), and another Jacobi
// step. What is slow for conjugate gradients are motions that stretch next to no spring, and those
// are rigid ones, patch by patch. The steps on particles run in single precision, the patches in
// double: their matrix is small where they move as one, a difference of large numbers.
class Multilevel {
 public:
  // masses of the particles in kg, infinity where pinned.
  Multilevel(const StageMatrix& matrix, const Particles& system);

  bool prepare(const StageMatrix& matrix);   // for it as it is now; false when it cannot be used
  double solve(const double* r, double* z);  // z := about A^-1 r; r.z

 private:
  static constexpr int kRow = RigidKernels::kRow;
  static Patches patches_of(const StageMatrix& matrix, const Particles& system,
                            PatchGraph& between);
  int patch(int i) const { return patches_.of[static_cast<std::size_t>(i)]; }
  template <class Visit>  // visit(i) of the particles of a patch
  void each_member(std::size_t patch, Visit visit) const {
    for (int at = first_[patch]; at < first_[patch + 1]; ++at)
      visit(members_[static_cast<std::size_t>(at)]);
  }
  void place_patches(const StageMatrix& matrix);
  void add_particles();
  void add_springs();
  void restrict_rest(const float* rest);
  void add_motions(float* x);

  Layout half_;
  SingleSprings springs_;
  Patches patches_;
  std::optional<RigidMatrix> rigid_;
  std::vector<int> first_, members_;  // particles of patches
  std::vector<int> places_;           // blocks of springs between two patches, in order
  std::vector<Vec3> arms_;            // of particles, in units of the size of their patch
  Array across_;                      // of particles, what springs to other patches add to D
  Array r_, x_;                       // of patches
  ArrayOf<float> rest_, guess_, more_;
};

}  // namespace sim
