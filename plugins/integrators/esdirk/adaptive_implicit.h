// Diagonally implicit methods with adaptive steps, for stiff systems.
#pragma once

#include <memory>
#include <vector>

#include "core/base/array.h"
#include "core/ode/explicit/embedded_rk.h"
#include "core/ode/explicit/step_controller.h"
#include "core/ode/implicit/implicit.h"
#include "core/ode/integrator.h"

namespace sim {

// An ESDIRK pair: the first stage is explicit, the others have the same a_ii = gamma, and the last
// is the next state. Error of a step: h sum_i (b_i - embedded_i) k_i.
template <int S>
struct ImplicitPair {
  Tableau<S> method;
  std::array<double, S> embedded;
};

template <int S>
constexpr int embedded_order(const ImplicitPair<S>& pair) {
  Tableau<S> other = pair.method;
  other.b = pair.embedded;
  return order_conditions(other);
}

// Adaptive steps to a tolerance of |error_i| <= atol + rtol |x_i|, whatever the interval at which
// states are asked for: the last step may end beyond them. A step whose equations are not solved is
// shortened. The first slope of a step is the last one of the step before, from the solved stage: f
// at a state with an error delta has the error lambda delta; after an event it is evaluated.
// Kennedy & Carpenter (2016), NASA/TM-2016-219173.
//
// Inside a step, theta of the way, the cubic through both ends with their slopes:
//   x + theta (y - x) + theta (1 - theta) ((1 - theta) (h k - (y - x)) - theta (h l - (y - x)))
// which is off by theta^2 (1 - theta)^2 h^4 x^(4) / 24, so that states there are of order 4, too.
class AdaptiveImplicit final : public Integrator {
 public:
  template <int S>
  AdaptiveImplicit(const ImplicitPair<S>& pair, int order, const Tolerance& tolerance,
                   const StageOptions& options)
      : plan_(plan_of(pair.method)),
        order_(order),
        tolerance_(tolerance),
        options_(options),
        controller_(order),
        fixed_(pair.method, order, options) {
    for (int i = 0; i < S; ++i) error_weights_.push_back(pair.method.b[i] - pair.embedded[i]);
  }

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
  std::vector<std::string> notes() const override { return solver_->notes(); }
  // The amplification of one internal step of size h.
  double amplification(double h_omega, double h_gamma) const override {
    return fixed_.amplification(h_omega, h_gamma);
  }

 private:
  void begin(OdeSystem& system, double t, double h, const double* x);
  StepStatus next_step(OdeSystem& system, double until, double asked);
  StepStatus end_at_event(OdeSystem& system);
  double try_step(OdeSystem& system, StepStatus& status);
  void interpolate(double t, double* out) const;
  double scaled_norm(const double* values, const double* x, const double* y) const;
  Stage from(const double* x, double h, const double* weights, int count);

  ExplicitPlan plan_;
  int order_;
  Tolerance tolerance_;
  StageOptions options_;
  StepController controller_;
  DiagonallyImplicit fixed_;  // for its amplification
  std::vector<double> error_weights_;
  std::unique_ptr<StageSolver> solver_;
  bool fresh_ = true;
  std::vector<Array> change_;  // gamma h k_i

  // The present step: from x_ at t_, with the slope slope_, to y_ at t_ + h_ with last_slope_.
  double t_ = 0, h_ = 0;
  Array x_, y_, slope_, last_slope_;
  Array r_, error_;
  std::vector<Stage::Term> terms_;
  Events* events_ = nullptr;  // of the system
  int cuts_ = 0;              // steps that ended at events in a row
  bool anew_ = false;         // f is another one than at the end of the step before
  Effort own_;
};

}  // namespace sim
