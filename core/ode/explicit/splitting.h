// All splitting methods: each is defined by the lengths of its drifts and kicks alone.
#pragma once

#include "core/base/error.h"
#include "core/ode/explicit/composition.h"
#include "core/ode/integrator.h"
#include "core/ode/stability.h"

namespace sim {

class Splitting final : public Integrator {
 public:
  template <int M>
  explicit Splitting(const Composition<M>& method, Precision precision = Precision::kDouble)
      : plan_(method.plan()), order_(order_conditions(method)) {
    plan_.precision = precision;
    plan_.order = order_;
  }

  IntegratorInfo info() const noexcept override {
    return {.order = order_,
            .evaluations = static_cast<int>(plan_.kick.size()) - (plan_.closes() ? 1 : 0),
            .needs_second_order = true,
            .symplectic = true,
            .precision = plan_.precision};
  }

  void prepare(OdeSystem& system) override {
    stepper_ = system.split_stepper(plan_);
    effort_ = {};
    fresh_ = true;
    if (!stepper_)
      throw Error(
          ErrorKind::kScene,
          {"integrator does not fit", "",
           "a splitting method of order " + std::to_string(order_) +
               " needs q' = v, v' = a(t, q) - gamma v, and this system is of first order or has a "
               "force that depends on velocity, or remembers, in another way",
           order_ > 2 ? "use rk4; for forces that depend on velocity also verlet" : "use rk4"});
  }

  Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override {
    const int count = stepper_->most_of(most);
    const bool done = stepper_->step(t, h, count, x, x_next);
    if (system.gave_up()) {
      restart(t, h, x);
      return {StepStatus::kStopped};
    }
    if (!done && count > 1) {
      restart(t, h, x);
      return advance(system, t, h, 1, x, x_next);
    }
    effort_.steps += count;
    if (stepper_->midpoint_kicks())
      effort_.evaluations += 2 * count * static_cast<int>(plan_.kick.size());
    else
      effort_.evaluations += count * info().evaluations + (fresh_ && plan_.closes() ? 1 : 0);
    fresh_ = false;
    return done ? Advance{StepStatus::kDone, count} : Advance{StepStatus::kNotFinite, 0};
  }

  void restart(double /*t*/, double /*h*/, const double* /*x*/) override {
    stepper_->restart();
    fresh_ = true;
  }

  Effort effort() const override { return effort_; }

  double amplification(double h_omega, double h_gamma) const override {
    return sim::amplification(plan_, h_omega, h_gamma, stepper_ && stepper_->midpoint_kicks());
  }

 private:
  SplitPlan plan_;
  int order_;
  std::unique_ptr<Stepper> stepper_;
  Effort effort_;
  bool fresh_ = true;  // the last acceleration of the step before is not there
};

}  // namespace sim
