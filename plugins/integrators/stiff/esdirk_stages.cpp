#include "esdirk_stages.h"

#include <algorithm>

namespace sim {

void EsdirkStages::prepare(OdeSystem& system) {
  solver_ = system.stage_solver(options_);
  change_.clear();
  for (int i = 0; i < plan_.stages; ++i) change_.emplace_back(system.size());
  r_ = Array(system.size());
  terms_.resize(change_.size());
}

// x + sum over the stages before `count` of weights_j h k_j.
Stage EsdirkStages::from(const double* x, double h, const double* slope, const double* weights,
                         int count) {
  std::size_t used = 0;
  for (int j = 0; j < count; ++j)
    if (weights[j] != 0)
      terms_[used++] =
          j == 0 ? Stage::Term{weights[j] * h, slope}
                 : Stage::Term{weights[j] / gamma(), change_[static_cast<std::size_t>(j)].data()};
  return {x, {terms_.data(), used}};
}

StepStatus EsdirkStages::step(OdeSystem& system, double t, double h, const double* x,
                              const double* slope, double* y, double* error) {
  const int stages = plan_.stages;
  const double tau = gamma() * h;
  for (int i = 1; i < stages; ++i) {
    const auto stage = static_cast<std::size_t>(i);
    double* const change = change_[stage].data();
    system.combine(from(x, h, slope, &plan_.a[stage * static_cast<std::size_t>(stages)], i),
                   r_.data());
    // The slope of the stage before is the guess.
    const Stage::Term guess =
        i == 1 ? Stage::Term{tau, slope} : Stage::Term{1, change_[stage - 1].data()};
    system.combine({r_.data(), {&guess, 1}}, y);
    const StepStatus status = solver_->solve(t + plan_.c[stage] * h, tau, r_.data(), y);
    if (status != StepStatus::kDone) return status;
    const Stage::Term minus{-1, r_.data()};
    system.combine({y, {&minus, 1}}, change);
  }
  std::ranges::fill(r_.span(), 0.0);
  system.combine(from(r_.data(), h, slope, error_weights_.data(), stages), error);
  return StepStatus::kDone;
}

void EsdirkStages::last_slope(OdeSystem& /*system*/, double /*t*/, double h, const double* /*y*/,
                              double* slope) {
  const double scale = 1 / (gamma() * h);
  for (std::size_t i = 0; i < r_.size(); ++i) slope[i] = scale * change_.back()[i];
}

}  // namespace sim
