// Implicit stages of particles by Newton's method.
#pragma once

#include <functional>
#include <memory>

#include "core/base/array.h"
#include "core/particles/implicit/linear_solver.h"
#include "core/particles/implicit/stage_equation.h"
#include "core/particles/implicit/stage_matrix.h"
#include "core/particles/particles.h"

namespace sim {

// A d = -g, v := v + s d. A full step is taken when it halves the residual; otherwise the potential
// Phi of the stage must fall enough. With forces that have no Phi the residual must fall.
// Residuals are measured in the norm |g|^2 = g.D^-1 g, D the 3 x 3 blocks on the diagonal of A, in
// which light and heavy particles count alike.
class NewtonSolver final : public StageSolver {
 public:
  // stopped(): asked now and then, ends a solution with kStopped.
  NewtonSolver(Particles& system, const StageOptions& options, std::function<bool()> stopped = {});

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  Effort effort() const override;
  std::vector<std::string> notes() const override;

 private:
  double norm();  // of the gradient
  void linearise(bool clamped);
  void find_direction(double eta);
  bool search(double before);

  Particles* system_;
  StageOptions options_;
  StageEquation equation_;
  StageMatrix matrix_;
  std::unique_ptr<LinearSolver> linear_;
  Array z_;
  double slope_ = 0;  // g.d
  Effort effort_;
};

}  // namespace sim
