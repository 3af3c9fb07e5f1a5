// A first-order system X' = f(t, X) whose right-hand side is a field; the state is a plain list.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/fields/field.h"
#include "core/ode/ode_system.h"

namespace sim {

class FieldSystem final : public OdeSystem {
 public:
  // `start`: the state that a run starts with, at t = 0.
  FieldSystem(std::span<const double> start, int dimension, std::unique_ptr<Field> field);

  std::size_t size() const noexcept override { return size_; }
  StateShape shape() const override {
    return dimension_ == 3 ? StateShape::points(size_ / 3) : StateShape::flat(size_);
  }
  void eval(double t, const Stage& stage, double* y, double* dydt) override;
  void combine(const Stage& stage, double* out) override { combine_range_(stage, out, 0, size_); }
  std::unique_ptr<Stepper> explicit_stepper(const ExplicitPlan& plan) override;
  std::unique_ptr<EmbeddedStepper> embedded_stepper(const EmbeddedPlan& plan) override;
  // The entries of the Jacobian, from the field or by differences.
  std::unique_ptr<StageSolver> stage_solver(const StageOptions& options) override;
  std::unique_ptr<LinearisedSolver> linearised_solver() override;
  std::unique_ptr<Jacobian> jacobian() override;

  const Field& field() const { return *field_; }
  std::span<const double> start() const { return start_; }

 private:
  std::vector<double> start_;
  std::size_t size_;
  int dimension_;
  CombineRange combine_range_ = combine_range();
  std::unique_ptr<Field> field_;
};

}  // namespace sim
