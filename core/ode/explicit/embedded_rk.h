// Embedded Runge-Kutta pairs with adaptive steps.
#pragma once

#include "core/base/array.h"
#include "core/ode/embedded_stepper.h"
#include "core/ode/explicit/step_controller.h"
#include "core/ode/integrator.h"
#include "core/ode/stability.h"

namespace sim {

// The error determines the steps, whatever the interval h at which states are asked for: a state
// inside a step comes from the dense output. The last step may therefore end beyond the last state.
// The solution advances with the weights of higher order.
class EmbeddedRungeKutta final : public Integrator {
 public:
  // `order` of the advancing method, which is also that of the error estimate of one step.
  EmbeddedRungeKutta(EmbeddedPlan plan, int order, const Tolerance& tolerance);

  IntegratorInfo info() const noexcept override;
  void prepare(OdeSystem& system) override;
  Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override;
  void restart(double /*t*/, double /*h*/, const double* /*x*/) override { phase_ = Phase::kFresh; }

  // The start of the present step and the controller's state; the stages are recomputed.
  std::vector<double> memory() const override;
  void recall(std::span<const double> memory) override;
  Effort effort() const override { return effort_; }

  // The amplification of one internal step of size h.
  double amplification(double h_omega, double h_gamma) const override {
    return sim::amplification(plan_.method, h_omega, h_gamma);
  }

 private:
  enum class Phase { kFresh, kRecalled, kRunning };

  bool begin(OdeSystem& system, double t, const double* x);
  double starting_step(OdeSystem& system);
  StepStatus next_step(OdeSystem& system, double until, double* x_failed);
  double try_step();
  bool close_step();
  bool end_at_event(double until);
  double scaled_error();
  double scaled_norm(const double* values, const double* x, const double* y) const;
  void interpolate(double t, double* out);
  void combine(const double* base, double h, std::span<const double> weights, double* out);

  bool estimate_needs_last() const { return plan_.error.back() != 0; }

  EmbeddedPlan plan_;
  int order_;
  Tolerance tolerance_;
  StepController controller_;
  Effort effort_;

  // The present step: from x_ at t_ to x_next_ at t_ + h_.
  Phase phase_ = Phase::kFresh;
  double t_ = 0, h_ = 0;
  bool extra_ready_ = false;  // the stages of dense output are there
  std::unique_ptr<EmbeddedStepper> stepper_;
  Array x_, x_next_, y_, error_, zero_;
  Array before_;  // the start of the step before, for one that is given up
  std::vector<double> weights_;
  Events* events_ = nullptr;  // of the system
  EventSeries series_;
};

}  // namespace sim
