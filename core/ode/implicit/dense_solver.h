// Implicit stages of any small system: Newton's method with a dense Jacobian.
#pragma once

#include <memory>

#include "core/base/array.h"
#include "core/ode/ode_system.h"

namespace sim {

// (I - tau J) d = -(Y - tau f(t, Y) - r),  Y := Y + s d,  s = 1, 1/2, 1/4 ... until the residual
// falls.
class DenseSolver final : public StageSolver {
 public:
  static constexpr std::size_t kMostNumbers = 2000;

  // Throws Error{kScene} for a system of more numbers.
  DenseSolver(OdeSystem& system, const StageOptions& options);
  ~DenseSolver() override;

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  Effort effort() const override { return effort_; }

 private:
  double residual(double t, double tau, const double* r, const double* y);
  double move(double t, double tau, const double* r, double* y, double s);
  void find_step(const double* y);
  void linearise(double t, double tau, const double* y);

  OdeSystem* system_;
  StageOptions options_;
  std::size_t size_;
  std::unique_ptr<Jacobian> jacobian_;
  Array f_, g_, start_, unit_, column_, point_;
  struct Matrices;
  std::unique_ptr<Matrices> matrices_;
  Effort effort_;
};

}  // namespace sim
