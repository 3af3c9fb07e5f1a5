// Implicit methods: sequences of one kind of stage,  Y - tau f(t, Y) = r  for Y.
#pragma once

#include <memory>

#include "core/base/array.h"
#include "core/ode/explicit/order_conditions.h"
#include "core/ode/integrator.h"
#include "core/ode/plan.h"

namespace sim {

// Diagonally implicit Runge-Kutta methods: a tableau that is lower triangular. Stage i with a_ii >
// 0:
//   r = x + h sum_{j<i} a_ij k_j,  tau = h a_ii,  k_i = (Y_i - r) / tau
class DiagonallyImplicit final : public Integrator {
 public:
  template <int S>
  DiagonallyImplicit(const Tableau<S>& method, int order, const StageOptions& options,
                     bool symplectic = false)
      : plan_(plan_of(method)), options_(options), order_(order), symplectic_(symplectic) {}

  IntegratorInfo info() const noexcept override {
    return {.order = order_,
            .needs_second_order = options_.method == StageOptions::Method::kLocalGlobal,
            .symplectic = symplectic_,
            .implicit = true};
  }
  void prepare(OdeSystem& system) override;
  Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override;
  void restart(double /*t*/, double /*h*/, const double* /*x*/) override { solver_->restart(); }
  std::vector<double> memory() const override { return solver_->memory(); }
  void recall(std::span<const double> memory) override { solver_->recall(memory); }
  Effort effort() const override;
  std::vector<std::string> notes() const override { return solver_->notes(); }
  double amplification(double h_omega, double h_gamma) const override;

 private:
  StepStatus take_stages(OdeSystem& system, double t, double h, const double* x, double* x_next);

  ExplicitPlan plan_;
  StageOptions options_;
  int order_;
  bool symplectic_;
  std::unique_ptr<StageSolver> solver_;
  std::vector<Array> change_;  // Y_i - r, or h k_i of an explicit stage
  Array r_;
  std::vector<Stage::Term> terms_;
  std::int64_t steps_ = 0, evaluations_ = 0;  // the latter of explicit stages
};

// BDF2:  x_next - 2/3 h f(t + h, x_next) = x + 1/3 (x - x_last).  The first step is made by
// `starter`.
class Bdf2 final : public Integrator {
 public:
  Bdf2(const StageOptions& options, std::unique_ptr<Integrator> starter)
      : options_(options), starter_(std::move(starter)) {}

  IntegratorInfo info() const noexcept override { return {.order = 2, .implicit = true}; }
  void prepare(OdeSystem& system) override;
  Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override;
  void restart(double /*t*/, double /*h*/, const double* /*x*/) override {
    last_h_ = 0;
    solver_->restart();
  }
  std::vector<double> memory() const override;
  void recall(std::span<const double> memory) override;
  Effort effort() const override;
  std::vector<std::string> notes() const override { return solver_->notes(); }
  double amplification(double h_omega, double h_gamma) const override;

 private:
  StageOptions options_;
  std::unique_ptr<Integrator> starter_;
  std::unique_ptr<StageSolver> solver_;
  double last_h_ = 0;  // the size of the step from last_; 0 when there is none
  Array last_, r_;
  std::int64_t steps_ = 0;
};

}  // namespace sim
