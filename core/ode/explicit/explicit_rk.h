// All explicit Runge-Kutta methods: each is defined by its tableau alone.
#pragma once

#include "core/ode/explicit/order_conditions.h"
#include "core/ode/integrator.h"
#include "core/ode/stability.h"

namespace sim {

class ExplicitRungeKutta final : public Integrator {
 public:
  template <int S>
  ExplicitRungeKutta(const Tableau<S>& method, int order, Precision precision = Precision::kDouble)
      : order_(order), plan_(plan_of(method)) {
    plan_.precision = precision;
  }

  IntegratorInfo info() const noexcept override {
    return {.order = order_, .evaluations = plan_.stages, .precision = plan_.precision};
  }

  void prepare(OdeSystem& system) override {
    stepper_ = system.explicit_stepper(plan_);
    steps_ = 0;
  }

  Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override {
    const int count = stepper_->most_of(most);
    const bool finite = stepper_->step(t, h, count, x, x_next);
    if (finite && !system.gave_up()) {
      steps_ += count;
      return {StepStatus::kDone, count};
    }
    stepper_->restart();
    if (system.gave_up()) return {StepStatus::kStopped};
    if (count > 1) return advance(system, t, h, 1, x, x_next);
    ++steps_;
    return {StepStatus::kNotFinite, 0};
  }

  void restart(double /*t*/, double /*h*/, const double* /*x*/) override { stepper_->restart(); }

  Effort effort() const override { return {.steps = steps_, .evaluations = steps_ * plan_.stages}; }

  double amplification(double h_omega, double h_gamma) const override {
    return sim::amplification(plan_, h_omega, h_gamma);
  }

 private:
  int order_;
  ExplicitPlan plan_;
  std::unique_ptr<Stepper> stepper_;
  std::int64_t steps_ = 0;
};

}  // namespace sim
