// Implicit stages of a system of unknown structure: Newton's method.
#pragma once

#include <memory>

#include "core/base/array.h"
#include "core/ode/ode_system.h"

namespace sim {

// (I - tau J) d = -(Y - tau f(t, Y) - r),  Y := Y + s d,  s = 1, 1/2, 1/4 ... until the residual
// decreases.
class StageNewton : public StageSolver {
 public:
  // Throws Error{kScene} for options that only systems of particles have.
  StageNewton(OdeSystem& system, const StageOptions& options);

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  Effort effort() const override;

 protected:
  virtual void linearise(double t, double tau, const double* y) = 0;  // I - tau J there
  virtual bool divide(Array& x) = 0;  // x := (I - tau J)^-1 x; false where that has no end

  OdeSystem& system() { return *system_; }
  Jacobian& jacobian() { return *jacobian_; }
  std::size_t size() const { return size_; }
  Effort effort_;

 private:
  double residual(double t, double tau, const double* r, const double* y);
  double move(double t, double tau, const double* r, double* y, double s);
  bool find_step(const double* y);

  OdeSystem* system_;
  StageOptions options_;
  std::unique_ptr<Jacobian> jacobian_;
  std::size_t size_;
  Array f_, g_, start_, step_, point_;
};

}  // namespace sim
