// All explicit Runge-Kutta methods: a tableau is all that a method has to give.
#pragma once

#include "core/ode/integrator.h"
#include "core/ode/stability.h"
#include "core/ode/tableau.h"

namespace sim {

class ExplicitRungeKutta final : public Integrator {
 public:
  template <int S>
  ExplicitRungeKutta(const Tableau<S>& method, int order) : order_(order) {
    plan_.stages = S;
    for (const auto& row : method.a) plan_.a.insert(plan_.a.end(), row.begin(), row.end());
    plan_.b.assign(method.b.begin(), method.b.end());
    plan_.c.assign(method.c.begin(), method.c.end());
  }

  IntegratorInfo info() const noexcept override {
    return {.order = order_, .evaluations = plan_.stages};
  }

  void prepare(OdeSystem& system) override { stepper_ = system.explicit_stepper(plan_); }

  StepStatus step(OdeSystem& /*system*/, double t, double h, const double* x,
                  double* x_next) override {
    return stepper_->step(t, h, x, x_next) ? StepStatus::kDone : StepStatus::kNotFinite;
  }

  double amplification(double h_omega, double h_gamma) const override {
    return sim::amplification(plan_, h_omega, h_gamma);
  }

 private:
  int order_;
  ExplicitPlan plan_;
  std::unique_ptr<Stepper> stepper_;
};

}  // namespace sim
