// The advancing method of a pair in equal steps.
#pragma once

#include <memory>
#include <utility>

#include "core/base/array.h"
#include "core/ode/integrator.h"
#include "pair_stages.h"

namespace sim {

class FixedPair final : public Integrator {
 public:
  FixedPair(std::unique_ptr<PairStages> stages, int order)
      : stages_(std::move(stages)), order_(order) {}

  IntegratorInfo info() const noexcept override { return {.order = order_, .implicit = true}; }
  void prepare(OdeSystem& system) override {
    stages_->prepare(system);
    slope_ = Array(system.size());
    error_ = Array(system.size());
    evaluations_ = 0;
  }
  void restart(double /*t*/, double /*h*/, const double* /*x*/) override { stages_->restart(); }
  Advance advance(OdeSystem& system, double t, double h, std::int64_t /*most*/, const double* x,
                  double* x_next) override {
    stages_->restart();
    system.eval(t, {x, {}}, x_next, slope_.data());
    ++evaluations_;
    const StepStatus status = stages_->step(system, t, h, x, slope_.data(), x_next, error_.data());
    if (status != StepStatus::kDone) return {status};
    if (!system.project(t + h, x_next)) return {StepStatus::kNotConverged};
    return {StepStatus::kDone, 1};
  }
  Effort effort() const override { return stages_->effort() + Effort{.evaluations = evaluations_}; }
  double amplification(double h_omega, double h_gamma) const override {
    return stages_->amplification(h_omega, h_gamma);
  }

 private:
  std::unique_ptr<PairStages> stages_;
  int order_;
  Array slope_, error_;
  std::int64_t evaluations_ = 0;
};

}  // namespace sim
