// A method of equal steps that ends them at events, and so keeps its order across them.
#pragma once

#include <memory>
#include <utility>

#include "core/base/array.h"
#include "core/ode/integrator.h"

namespace sim {

// A step with an event is repeated up to the event, as often as it takes to locate it, and the rest
// of the step starts anew. Without events: the steps and the bits of the method.
class CutSteps final : public Integrator {
 public:
  explicit CutSteps(std::unique_ptr<Integrator> method) : method_(std::move(method)) {}

  IntegratorInfo info() const noexcept override { return method_->info(); }
  void prepare(OdeSystem& system) override;
  Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override;
  void set_step_size(double h) override { method_->set_step_size(h); }
  void restart(double t, double h, const double* x) override { method_->restart(t, h, x); }
  std::vector<double> memory() const override { return method_->memory(); }
  void recall(std::span<const double> memory) override { method_->recall(memory); }
  Effort effort() const override { return method_->effort(); }
  std::vector<std::string> notes() const override { return method_->notes(); }
  double amplification(double h_omega, double h_gamma) const override {
    return method_->amplification(h_omega, h_gamma);
  }
  OdeSystem* limiting_part() const override { return method_->limiting_part(); }

 private:
  std::unique_ptr<Integrator> method_;
  Array from_, to_;
};

}  // namespace sim
