// The matrix of a Newton step for an implicit stage, applied without being assembled.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "block_diagonal.h"
#include "block_matrix.h"
#include "core/base/array.h"
#include "core/particles/particles.h"
#include "core/particles/plugin_force_jacobian.h"
#include "core/particles/springs/stiffness.h"
#include "core/particles/velocity_inequality.h"

namespace sim {

// A = M + tau c + tau^2 K - tau^2 dF/dq - tau dF/dv over the free particles, K of the springs and F
// of the other forces; D: its 3 x 3 blocks on the diagonal. A vector has three coordinates of every
// particle, in `layout()`, and is 0 where pinned and on the padding.
class StageMatrix final : public BlockMatrix {
 public:
  explicit StageMatrix(Particles& system, std::function<bool()> stopped = {});

  const Layout& layout() const noexcept override { return half_; }
  // Springs and affine forces alone: A is symmetric, and positive definite when clamped.
  bool symmetric() const noexcept { return others_.empty(); }
  const Stiffness& stiffness() const noexcept { return stiffness_; }
  const PluginForceJacobian& others() const noexcept { return others_; }
  double tau() const noexcept { return tau_; }
  bool stopped() const override { return stopped_ && stopped_(); }
  Mat3 diagonal(int i) const override { return diagonal_.block(i); }
  double shift(int i) const;  // M + tau c
  // The springs are the fixed pairs, in the order of Stiffness::for_each; others are blocks of all
  // other forces.
  std::vector<std::array<int, 2>> fixed_pairs() const override;
  void for_each_pair(const VisitPair& spring, const VisitPair& other) const override;
  const double* shifts() const { return Layout(half_.n(), 1).block(shift_.data(), 0); }
  double largest() const;                   // entry of D on its diagonal
  double stiffness_ratio() const override;  // the largest entry of D over its shift M + tau c

  // The geometric stiffness of compressed springs: none, or limited in sum at each particle to
  // `share` of half its shift. A is positive definite for share < 1, and exact for an infinite
  // share.
  struct Model {
    bool clamped = false;
    double share = HUGE_VAL;
  };

  // Chooses the point; the arrays of the view must stay as they are until the last use. With
  // `before`, other positions, tensions are predicted from there (predicted_stiffness).
  void at(const ParticleView& view, double tau, const Model& model,
          const double* const* before = nullptr);

  // Restricts A and D to the directions that the inequality constraints leave: conjugate gradients
  // then stay in that subspace (Baraff & Witkin 1998). Null or no active plane: all directions.
  void restrict_to(const VelocityInequalities* bounds);
  void project_directions(double* r) const;  // r := its part in the feasible directions
  bool restricted() const noexcept override { return restricted_; }

  double apply(const double* p, double* out) override;
  double precondition(const double* r, double* z) override { return diagonal_.multiply(r, z); }
  double turn_and_apply(double beta, const double* z, double* p, double* out) override;
  double advance(double alpha, const double* p, const double* ap, double* d, double* r,
                 double* z) override {
    return diagonal_.advance(alpha, p, ap, d, r, z);
  }

  // p.B p with B = M + tau c + tau^2 L, L the springs without their rest lengths: B - A is positive
  // semidefinite wherever A is taken.
  double majorant(const double* p) const;

  // The largest |change of a spring's vector| over its length, when velocities change by p.
  double largest_turn(const double* p) const;

  // The norm of rounding errors: of velocities, and of the forces at q = .. + tau v, by the share
  // (D - M) / D that forces have in the diagonal.
  double rounding(const ParticleView& view) const;

 private:
  void apply_others(const double* p, double* out);
  double apply_drag(const double* p, double* out) const;

  Particles* system_;
  std::function<bool()> stopped_;
  Layout half_;
  BlockDiagonal diagonal_;
  Stiffness stiffness_;
  PluginForceJacobian others_;
  const VelocityInequalities* bounds_ = nullptr;
  bool restricted_ = false;
  double tau_ = 0;
  int reach_ = 0;  // up to which a product reads ahead
  Array shift_, moved_, sums_;
};

}  // namespace sim
