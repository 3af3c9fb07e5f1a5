// Implicit stages of particles by Newton's method.
#pragma once

#include <functional>
#include <memory>

#include "core/base/array.h"
#include "core/particles/particles.h"
#include "implicit_contact.h"
#include "lbfgs.h"
#include "stage_equation.h"
#include "stage_linear_solver.h"
#include "stage_matrix.h"

namespace sim {

// A d = -g, v := v + s d.
//
// Springs and affine forces alone: the potential Phi of the stage is minimised, and a stationary
// point is always found, for Phi is bounded below. Tensions are predicted, and steps are whole: Phi
// may rise in between, but if a few steps find nothing lower than the best point so far, the next
// starts there with a model that is known to lower Phi, in a step that is short enough for a
// majorant of Phi. The geometric stiffness of compressed springs is reduced at first, so that A is
// positive definite, and less so where convergence is slow, up to the exact Hessian. If A is then
// not positive definite, L-BFGS takes over, whose initial inverse Hessian is the preconditioner of
// a definite A; or the stiffness is reduced again; or near a saddle Phi is followed downhill along
// a direction of negative curvature.
//
// With other forces the residual |g| must fall in each step.
//
// Residuals are measured in the norm |g|^2 = g.D^-1 g, D the 3 x 3 blocks on the diagonal of A, in
// which light and heavy particles count alike.
class NewtonSolver final : public StageSolver {
 public:
  // stopped(): polled, ends a solution with kStopped. contact: the inequalities on the velocities
  // of stages, which outlive the solver; null: none.
  NewtonSolver(Particles& system, const StageOptions& options, std::function<bool()> stopped = {},
               ImplicitContact* contact = nullptr);

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  Effort effort() const override;
  std::vector<std::string> notes() const override;

 private:
  static constexpr double kExact = HUGE_VAL, kSafe = 0.9;  // shares of StageMatrix::Model

  StepStatus linearised();
  StepStatus minimise();
  StepStatus reduce();
  StepStatus ended(double first, double last);
  double norm();  // of the gradient
  double goal_from(double first, double tolerance);
  double tolerance() const;  // of the stage, after a first step
  void evaluate();
  void linearise(double share, bool predicted = false);
  LinearResult find_direction(double eta);          // d := -A^-1 g, within the bounds
  LinearResult solve_linear(Array& g, double eta);  // under the active inequalities
  void find_definite_direction(double eta);
  double descend(const double* direction);
  bool can_use_lbfgs();
  bool minimise_lbfgs(double goal);
  double search_flat();
  void stretch(double& length, double slope);
  bool search_surely();
  bool search_residual(double before);
  void choose_start();
  void keep_best();
  void keep_before();

  Particles* system_;
  ImplicitContact* contact_;
  StageOptions options_;
  StageEquation equation_;
  StageMatrix matrix_;
  std::unique_ptr<LinearSolver> linear_;
  Array z_, before_, best_;          // positions before the last step; velocities of the lowest Phi
  Array guess_, first_gradient_;     // velocities at the start and g there
  Array offset_, pulled_;            // m/s onto planes; g and A times that
  Lbfgs lbfgs_;                      // in a slide
  double best_phi_ = 0, noise_ = 0;  // J; its rounding error
  Effort effort_;
};

}  // namespace sim
