#include "core/ode/implicit/adaptive_implicit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/finite.h"

namespace sim {

void AdaptiveImplicit::prepare(OdeSystem& system) {
  solver_ = system.stage_solver(options_);
  change_.clear();
  for (int i = 0; i < plan_.stages; ++i) change_.emplace_back(system.size());
  for (Array* array : {&x_, &y_, &r_, &error_, &slope_, &slope_before_})
    *array = Array(system.size());
  terms_.resize(change_.size());
  events_ = system.events();
  cuts_ = 0;
  anew_ = false;
  own_ = {};
  fresh_ = true;
}

// x + sum over the stages before `count` of weights_j h k_j.
Stage AdaptiveImplicit::from(const double* x, double h, const double* weights, int count) {
  const double gamma = plan_.a_at(1, 1);
  std::size_t used = 0;
  for (int j = 0; j < count; ++j)
    if (weights[j] != 0)
      terms_[used++] =
          j == 0 ? Stage::Term{weights[j] * h, slope_.data()}
                 : Stage::Term{weights[j] / gamma, change_[static_cast<std::size_t>(j)].data()};
  return {x, {terms_.data(), used}};
}

void AdaptiveImplicit::find_slope(OdeSystem& system, double t, const double* x) {
  system.eval(t, {x, {}}, y_.data(), slope_.data());
  ++own_.evaluations;
}

// A step of Euler's method that changes the state by half of the tolerance.
double AdaptiveImplicit::starting_step(OdeSystem& system, double t, const double* x) {
  find_slope(system, t, x);
  const double slope = scaled_norm(slope_.data(), x, x);
  return slope > 0 ? 0.5 / slope : HUGE_VAL;
}

// y_ := the state after h from x_; the error, in units of the tolerance.
double AdaptiveImplicit::try_step(OdeSystem& system, double t, double h, StepStatus& status) {
  const int stages = plan_.stages;
  const double tau = plan_.a_at(1, 1) * h;
  for (int i = 1; i < stages; ++i) {
    const auto stage = static_cast<std::size_t>(i);
    double* const change = change_[stage].data();
    system.combine(from(x_.data(), h, &plan_.a[stage * static_cast<std::size_t>(stages)], i),
                   r_.data());
    // The slope of the stage before is the guess.
    const Stage::Term guess =
        i == 1 ? Stage::Term{tau, slope_.data()} : Stage::Term{1, change_[stage - 1].data()};
    system.combine({r_.data(), {&guess, 1}}, y_.data());
    status = solver_->solve(t + plan_.c[stage] * h, tau, r_.data(), y_.data());
    if (status != StepStatus::kDone) return std::nan("");
    const Stage::Term minus{-1, r_.data()};
    system.combine({y_.data(), {&minus, 1}}, change);
  }
  std::ranges::fill(r_.span(), 0.0);
  system.combine(from(r_.data(), h, error_weights_.data(), stages), error_.data());
  return scaled_norm(error_.data(), x_.data(), y_.data());
}

// The step that stands, from x_ to y_, taken again up to its first event.
StepStatus AdaptiveImplicit::end_at_event(OdeSystem& system, double t, double& step) {
  constexpr int kTries = 12;        // of meeting one event
  constexpr double kLonger = 1000;  // than the step before: another event may be as near
  const bool cut = cuts_ < Events::kMostCuts;
  if (!cut) events_->gave_up();
  bool met = false;
  for (int n = 0; cut && n < kTries; ++n) {
    const double s = events_->first(t, step, x_.data(), y_.data());
    if (!(s < 1)) break;
    step *= s;
    met = true;
    StepStatus status = StepStatus::kDone;
    try_step(system, t, step, status);
    if (status != StepStatus::kDone) return status;
    system.settle(t + step, y_.data());
  }
  cuts_ = met ? cuts_ + 1 : 0;
  if (met) controller_.state.h = std::min(controller_.state.h, kLonger * step);
  using Outcome = Events::Outcome;
  const Outcome outcome = events_->end(t, step, x_.data(), y_.data(), cut);
  if (outcome == Outcome::kNotAllowed) return StepStatus::kNotFinite;
  anew_ = met || outcome == Outcome::kJumped;
  return StepStatus::kDone;
}

Advance AdaptiveImplicit::advance(OdeSystem& system, double t, double h, std::int64_t /*most*/,
                                  const double* x, double* x_next) {
  constexpr double kSmallest = 1e-13;  // of h
  const StepController::State before = controller_.state;
  const bool was_fresh = fresh_, was_anew = anew_;
  const int cuts_before = cuts_;
  const auto stop = [&](StepStatus status) {
    // As it was, so that the next call takes the same step.
    controller_.state = before;
    fresh_ = was_fresh;
    anew_ = was_anew;
    cuts_ = cuts_before;
    std::ranges::copy(slope_before_.span(), slope_.data());
    std::copy_n(status == StepStatus::kNotFinite ? y_.data() : x, x_.size(), x_next);
    if (status == StepStatus::kNotFinite && all_finite({x_next, x_.size()}))
      status = StepStatus::kStepTooSmall;
    return Advance{status};
  };
  std::copy_n(x, x_.size(), x_.data());
  std::ranges::copy(slope_.span(), slope_before_.data());
  if (fresh_) {
    if (events_) events_->begin(t, h, x);
    controller_.state = {.h = std::min(h, starting_step(system, t, x))};
  }
  for (double done = 0; done < h;) {
    if (system.stopped()) return stop(StepStatus::kStopped);
    const double wanted = std::min(controller_.state.h, tolerance_.max_step);
    const bool last = wanted > 0.999 * (h - done);
    double step = last ? h - done : wanted;
    controller_.state.h = step;
    StepStatus status = StepStatus::kDone;
    if (events_) events_->begin(t + done, h - done, x_.data());
    if (std::exchange(anew_, false)) find_slope(system, t + done, x_.data());
    const double error = try_step(system, t + done, step, status);
    if (status == StepStatus::kStopped) return stop(status);
    const bool stands = controller_.accept(error);
    if (!stands) {
      ++own_.rejected;
      if (controller_.state.h < kSmallest * h)
        return stop(status == StepStatus::kNotFinite ? status : StepStatus::kStepTooSmall);
      continue;
    }
    ++own_.steps;
    fresh_ = false;
    // A step that was cut says nothing against the size before.
    if (last) controller_.state.h = std::max(controller_.state.h, std::min(wanted, 2 * h));
    const double whole = step;
    if (events_) {
      if (!system.settle(t + done + step, y_.data())) return stop(StepStatus::kNotConverged);
      status = end_at_event(system, t + done, step);
      if (status != StepStatus::kDone) return stop(status);
    }
    const double scale = 1 / (plan_.a_at(1, 1) * step);
    for (std::size_t i = 0; i < x_.size(); ++i) slope_[i] = scale * change_.back()[i];
    std::swap(x_, y_);
    done = last && step == whole ? h : done + step;
    if (!events_ && !system.settle(t + done, x_.data())) return stop(StepStatus::kNotConverged);
  }
  std::copy_n(x_.data(), x_.size(), x_next);
  return {StepStatus::kDone, 1};
}

// The largest |value_i| / (atol + rtol max(|x_i|, |y_i|)); not a number when one is not finite.
double AdaptiveImplicit::scaled_norm(const double* values, const double* x, const double* y) const {
  double most = 0;
  for (std::size_t i = 0; i < x_.size(); ++i) {
    const double size = std::max(std::fabs(x[i]), std::fabs(y[i]));
    const double ratio = std::fabs(values[i]) / (tolerance_.atol + tolerance_.rtol * size);
    if (!(ratio <= most)) most = ratio;
    if (std::isnan(most)) break;
  }
  return most;
}

std::vector<double> AdaptiveImplicit::memory() const {
  if (fresh_) return {};
  const StepController::State& state = controller_.state;
  std::vector<double> kept{state.h, state.error_before, state.repeated ? 1.0 : 0.0};
  kept.insert(kept.end(), slope_.span().begin(), slope_.span().end());
  if (events_) kept.insert(kept.end(), {static_cast<double>(cuts_), anew_ ? 1.0 : 0.0});
  return kept;
}

void AdaptiveImplicit::recall(std::span<const double> memory) {
  const std::size_t events = events_ ? 2 : 0, slope = 3 + slope_.size();
  fresh_ = memory.size() != slope + events;
  if (fresh_) return;
  cuts_ = events_ ? static_cast<int>(std::clamp(memory[slope], 0.0, 1.0 * Events::kMostCuts)) : 0;
  anew_ = events_ && memory[slope + 1] != 0;
  controller_.state = {memory[0], memory[1], memory[2] != 0};
  std::ranges::copy(memory.subspan(3, slope_.size()), slope_.data());
}

Effort AdaptiveImplicit::effort() const {
  Effort effort = solver_ ? solver_->effort() : Effort{};
  effort.steps = own_.steps;
  effort.rejected = own_.rejected;
  effort.evaluations += own_.evaluations;
  return effort;
}

}  // namespace sim
