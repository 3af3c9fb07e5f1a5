// The solver that projects states and velocities onto the constraints of a system.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/linear/row_matrix.h"
#include "core/particles/constraints/constraints.h"
#include "core/particles/constraints/implicit_drift.h"

namespace sim {

// Solves for the multipliers of the constraints, state after state, with memory of its own. Each
// user has its own solver, which keeps its factors.
class ConstraintSolver {
 public:
  using Axes = Constraints::Axes;

  // pool: its threads share the work of separate mechanisms, with the same bits; null: the
  // caller's.
  explicit ConstraintSolver(const Constraints& constraints, ThreadPool* pool = nullptr);

  // a += W J^T lambda with J (a + W J^T lambda) + bias = -2 c (J v + drive) - c^2 phi, where c is
  // the feedback: d2 phi / dt2 = 0 without it (Witkin (1997), Constrained dynamics; the feedback is
  // that of Baumgarte (1972)). multipliers() has lambda, in N. False if a number is not finite.
  bool accelerate(const ParticleView& view, const double* memory, const Axes& a);

  // Moves q and v to the nearest state, in the metric of the masses, with phi = 0 and J v + drive =
  // 0 (Hairer, Lubich & Wanner (2006), section IV.4). near: the last factors belong to a state near
  // enough to be used. False if there is none in reach.
  bool project_state(double t, const ParticleView& like, const Axes& q, const Axes& v,
                     double* memory, bool near);

  // Projects q alone.
  bool project_positions(double t, const ParticleView& like, const Axes& q, const Axes& v,
                         const double* memory, bool near);

  // The two halves of RATTLE (Andersen (1983), J. Comput. Phys. 52, 24-34), in the metric of
  // `weights`. The first is SHAKE: v += W J^T mu with J at q, such that q + d v satisfies the
  // equations at t + d.
  bool shake_positions(double t, double d, const ParticleView& like, const Axes& q, const Axes& v,
                       const double* memory, std::span<const double> weights, bool factorised);
  // w d / tau max sum |mu c| of the last one: (omega d)^2 of the fastest mode of the constraint
  // forces, at most, for a kick of length tau before the drift; above 4 SHAKE is not stable.
  double stiffness(double d, double tau, const ParticleView& view, const double* memory);
  // A drift without that limit: q and v at t become those at t + d. The velocities are projected in
  // the metric of `weights` before it. It is made in 1, 2, 4, .. parts, as many as needed; false,
  // with q and v unchanged, if 16 are too few.
  bool drift(double t, double d, const ParticleView& like, const Axes& q, const Axes& v,
             const double* memory, std::span<const double> weights);
  // v += W J^T nu, J at q, such that J v + drive = 0.
  bool rattle_velocities(double t, const ParticleView& like, const Axes& q, const Axes& v,
                         const double* memory, std::span<const double> weights);

  std::span<const double> multipliers() const { return lambda_; }
  const RowValues& values() const { return values_; }
  const RowMatrix& matrix() const { return matrix_; }

  // The reason why the last call failed; empty if it did not.
  std::string refusal() const;

 private:
  enum class Failure { kNone, kNotFinite, kTooFar };

  bool evaluate(double t, ParticleView like, const Axes& q, const Axes& v, const double* memory,
                RowValues& values);
  bool fail(Failure failure, const RowValues& values);
  bool ran_away(double off, const RowValues& values);
  void remove(std::span<const double> weights, const RowValues& values, const Axes& from);
  bool project_velocities(std::span<const double> weights, const RowValues& values, const Axes& v,
                          bool exact);
  bool drift_in_parts(int parts, double t, double d, const ParticleView& like, const Axes& q,
                      const Axes& v, const double* memory);

  const Constraints* constraints_;
  RowValues values_, other_;
  RowMatrix matrix_;
  std::vector<double> lambda_, rest_;
  std::vector<double> trial_;  // positions on trial
  CurvatureBound curvature_;
  std::unique_ptr<ImplicitDrift> implicit_drift_;  // from its first use on
  std::vector<double> start_;                      // of it, q and v axis by axis
  Failure failure_ = Failure::kNone;
  bool exact_ = false;   // the factors are those of values_
  int worst_ = 0;        // row of the failure
  double residual_ = 0;  // by how much
};

}  // namespace sim
