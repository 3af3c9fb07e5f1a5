// Particles as a system X' = f(t, X): which stepper or solver a plan gets.
#pragma once

#include "core/ode/ode_system.h"
#include "core/particles/particles.h"

namespace sim {

class ParticleSystem final : public OdeSystem, public Particles {
 public:
  using Particles::Particles;

  std::size_t size() const noexcept override { return layout().size() + memory_size(); }
  StateShape shape() const override;
  bool confined() const noexcept override { return !contacts().empty(); }
  std::string refusal() const override;
  std::vector<std::string> notes() const override { return contacts().notes(); }
  void eval(double t, const Stage& stage, double* y, double* dydt) override;
  void combine(const Stage& stage, double* out) override;
  std::unique_ptr<Stepper> explicit_stepper(const ExplicitPlan& plan) override;
  std::unique_ptr<EmbeddedStepper> embedded_stepper(const EmbeddedPlan& plan) override;
  std::unique_ptr<Stepper> split_stepper(const SplitPlan& plan) override;
  std::unique_ptr<StageSolver> stage_solver(const StageOptions& options) override;
  std::unique_ptr<Jacobian> jacobian() override;

 private:
  CombineRange combine_range_ = combine_range();
};

}  // namespace sim
