// Implicit stages of particles under forces whose internal variables depend on time alone.
#pragma once

#include <memory>

#include "core/ode/ode_system.h"
#include "core/particles/particles.h"

namespace sim {

// m' = g(t, m) as a system of its own.
class InternalVariableSystem final : public OdeSystem {
 public:
  explicit InternalVariableSystem(const Particles& particles) : particles_(&particles) {}

  std::size_t size() const noexcept override { return particles_->internal_size(); }
  void eval(double t, const Stage& stage, double* y, double* dydt) override;
  void combine(const Stage& stage, double* out) override { combine_range_(stage, out, 0, size()); }

 private:
  const Particles* particles_;
  CombineRange combine_range_ = combine_range();
};

// Y - tau f(t, Y) = r is block triangular: the internal variables of Y first, then with them the
// particles.
class BlockTriangularSolver final : public StageSolver {
 public:
  BlockTriangularSolver(const Particles& particles, std::unique_ptr<StageSolver> solver,
                        const StageOptions& options);

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  Effort effort() const override { return solver_->effort(); }
  std::vector<std::string> notes() const override { return solver_->notes(); }

 private:
  std::size_t internal_begin_;  // offset of the internal variables
  InternalVariableSystem system_;
  std::unique_ptr<StageSolver> internal_solver_, solver_;
};

}  // namespace sim
