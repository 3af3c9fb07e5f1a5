// Implicit stages of any small system: a dense Jacobian.
#pragma once

#include <memory>

#include "core/ode/implicit/jacobian_entries.h"
#include "core/ode/implicit/stage_newton.h"

namespace sim {

class DenseSolver final : public StageNewton {
 public:
  static constexpr std::size_t kMostNumbers = 2000;

  // Throws Error{kScene} for a system that is too large.
  DenseSolver(OdeSystem& system, const StageOptions& options);
  ~DenseSolver() override;

 private:
  void linearise(double t, double tau, const double* y) override;
  bool divide(Array& x) override;

  JacobianColumns columns_;
  struct Matrices;
  std::unique_ptr<Matrices> matrices_;
};

}  // namespace sim
