// Methods with adaptive steps for stiff systems.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "core/base/array.h"
#include "core/ode/explicit/embedded_rk.h"
#include "core/ode/integrator.h"
#include "esdirk_stages.h"
#include "pair_stages.h"

namespace sim {

// Adaptive steps to a tolerance of |error_i| <= atol + rtol |x_i|, whatever the interval at which
// states are asked for: the last step may end beyond them. A step whose equations are not solved is
// shortened. The first slope of a step is the last one of the step before; after an event it is
// evaluated.
class AdaptiveImplicit final : public Integrator {
 public:
  AdaptiveImplicit(std::unique_ptr<PairStages> stages, int order, const Tolerance& tolerance,
                   StepController::Control control)
      : stages_(std::move(stages)),
        order_(order),
        tolerance_(tolerance),
        controller_(order, control) {}
  template <int S>
  AdaptiveImplicit(const ImplicitPair<S>& pair, int order, const Tolerance& tolerance,
                   const StageOptions& options)
      : AdaptiveImplicit(std::make_unique<EsdirkStages>(pair, order, options), order, tolerance,
                         StepController::Control::kProportionalIntegral) {}

  IntegratorInfo info() const noexcept override {
    return {.order = order_, .adaptive = true, .implicit = true};
  }
  void prepare(OdeSystem& system) override;
  Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override;
  void restart(double /*t*/, double /*h*/, const double* /*x*/) override { fresh_ = true; }
  // The present step, and the controller's state.
  std::vector<double> memory() const override;
  void recall(std::span<const double> memory) override;
  Effort effort() const override;
  std::vector<std::string> notes() const override { return stages_->notes(); }
  // The amplification of one internal step of size h.
  double amplification(double h_omega, double h_gamma) const override {
    return stages_->amplification(h_omega, h_gamma);
  }

 private:
  void begin(OdeSystem& system, double t, double h, const double* x);
  StepStatus next_step(OdeSystem& system, double until, double asked);
  StepStatus end_at_event(OdeSystem& system);
  double try_step(OdeSystem& system, StepStatus& status);
  void state_at(OdeSystem& system, double t, double* out);
  double scaled_norm(const double* values, const double* x, const double* y) const;

  std::unique_ptr<PairStages> stages_;
  int order_;
  Tolerance tolerance_;
  StepController controller_;
  bool fresh_ = true;

  // The present step: from x_ at t_, with the slope slope_, to y_ at t_ + h_ with last_slope_.
  double t_ = 0, h_ = 0;
  Array x_, y_, slope_, last_slope_;
  Array error_;
  Events* events_ = nullptr;  // of the system
  EventSeries series_;
  int since_ = 0;      // steps since the last state that was asked for
  bool anew_ = false;  // f is another one than at the end of the step before
  Effort own_;
};

}  // namespace sim
