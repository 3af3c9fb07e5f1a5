// Implicit stages of a system whose Jacobian is known by its entries.
#pragma once

#include <memory>
#include <vector>

#include "core/ode/implicit/jacobian_entries.h"
#include "core/ode/implicit/matrix_solver.h"
#include "core/ode/implicit/stage_newton.h"

namespace sim {

// Newton's method with a Jacobian and a factorisation that are reused from one equation to the next
// for as long as it converges (Hairer & Wanner, Solving ODEs II (1996), section IV.8). If it does
// not, the Jacobian is evaluated anew at the guess; then, for methods with fixed steps, steps of
// StageNewton follow, each with a Jacobian of its own.
class SparseNewton final : public StageNewton {
 public:
  SparseNewton(OdeSystem& system, const StageOptions& options,
               std::unique_ptr<JacobianEntries> jacobian);

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  void restart() override { known_ = false; }
  // The point at which the Jacobian was evaluated; it and its factors are recomputed.
  std::vector<double> memory() const override;
  void recall(std::span<const double> memory) override;
  Effort effort() const override;

 private:
  void linearise(double t, double tau, const double* y) override;
  bool divide(Array& x) override;

  // kDone, kNotConverged or kNotFinite.
  StepStatus solve_to_weights(double t, double tau, const double* r, double* y);
  StepStatus solve_to_residual(double t, double tau, const double* r, double* y);
  bool take_jacobian(double t, double tau, const double* y);
  bool factorise(double tau);
  double weighted(const Array& values, const double* y) const;

  StageOptions options_;
  std::unique_ptr<JacobianEntries> jacobian_;
  std::unique_ptr<MatrixSolver> matrix_;
  std::vector<double> values_;
  bool known_ = false;  // the factors, of the Jacobian at
  double t_ = 0;        // and
  Array point_;
  double tau_ = 0;
  double rate_ = 1;  // at which the last equation converged
  Array start_, guess_, slope_, rest_;
};

}  // namespace sim
