#include "adaptive_implicit.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/base/finite.h"

namespace sim {

void AdaptiveImplicit::prepare(OdeSystem& system) {
  stages_->prepare(system);
  for (Array* array : {&x_, &y_, &slope_, &last_slope_, &error_}) *array = Array(system.size());
  events_ = system.events();
  series_ = {};
  anew_ = false;
  own_ = {};
  fresh_ = true;
}

// Begins with a step of size 0 that ends in x. The next one is such that Euler's method would
// change the state by half of the tolerance.
void AdaptiveImplicit::begin(OdeSystem& system, double t, double h, const double* x) {
  stages_->restart();
  t_ = t;
  h_ = 0;
  std::copy_n(x, x_.size(), x_.data());
  if (events_) events_->begin(t, h, x);
  system.eval(t, {x, {}}, y_.data(), last_slope_.data());
  ++own_.evaluations;
  std::copy_n(x, x_.size(), y_.data());
  const double slope = scaled_norm(last_slope_.data(), x, x);
  controller_.state = {.h = slope > 0 ? 0.5 / slope : h};
  series_ = {};
  since_ = 0;
  anew_ = false;
}

// y_ := the state after h_ from x_; the error, in units of the tolerance.
double AdaptiveImplicit::try_step(OdeSystem& system, StepStatus& status) {
  status = stages_->step(system, t_, h_, x_.data(), slope_.data(), y_.data(), error_.data());
  if (status != StepStatus::kDone) return std::nan("");
  return scaled_norm(error_.data(), x_.data(), y_.data());
}

// Repeats the accepted step, from x_ to y_, up to its first event.
StepStatus AdaptiveImplicit::end_at_event(OdeSystem& system) {
  const bool cut = series_.cuts();
  if (!cut) events_->gave_up();
  const auto shorten = [&](double h) {
    h_ = h;
    StepStatus status = StepStatus::kDone;
    try_step(system, status);
    if (status == StepStatus::kDone) system.project(t_ + h_, y_.data());
    return status;
  };
  StepStatus status = StepStatus::kDone;
  if (h_ > series_.longest()) status = shorten(series_.longest());
  bool met = false;
  for (int n = 0; cut && n < Events::kTries; ++n) {
    const double s = events_->first(t_, h_, x_.data(), y_.data());
    if (!(s < 1)) break;
    met = true;
    status = shorten(s * h_);
    if (status != StepStatus::kDone) break;
  }
  if (status != StepStatus::kDone) return status;
  series_.add(met, h_);
  if (met) controller_.state.h = std::min(controller_.state.h, Events::kLonger * h_);
  using Outcome = Events::Outcome;
  const Outcome outcome = events_->end(t_, h_, x_.data(), y_.data(), cut);
  anew_ = met || outcome == Outcome::kImpact;
  return outcome == Outcome::kNotAllowed ? StepStatus::kNotAllowed : StepStatus::kDone;
}

// The step after the present one, retried until its error is within the tolerance; with events it
// ends at `until` at the latest, as there is no dense output across resolved contact. If there is
// none, the present step is one of size 0, so that the next call tries the same.
StepStatus AdaptiveImplicit::next_step(OdeSystem& system, double until, double asked) {
  constexpr double kSmallest = 1e-13;  // of the first trial
  const StepController::State before = controller_.state;
  const double h_before = h_;
  const EventSeries series_before = series_;
  const bool was_anew = anew_;
  t_ += h_;
  std::swap(x_, y_);
  std::swap(slope_, last_slope_);
  if (events_) events_->begin(t_, until - t_, x_.data());
  if (anew_) {
    system.eval(t_, {x_.data(), {}}, y_.data(), slope_.data());
    ++own_.evaluations;
  }
  StepStatus status = StepStatus::kDone;
  for (;;) {
    const double wanted = std::min(controller_.state.h, tolerance_.max_step);
    const bool last = events_ && wanted > 0.999 * (until - t_);
    h_ = controller_.state.h = last ? until - t_ : wanted;
    if (!(t_ + 0.1 * h_ > t_) || h_ < kSmallest * before.h) {
      const bool finite = status != StepStatus::kNotFinite || all_finite(y_.span());
      status = finite ? StepStatus::kStepTooSmall : StepStatus::kNotFinite;
      break;
    }
    const double error = try_step(system, status);
    if (status == StepStatus::kStopped) break;
    if (!controller_.accept(error, h_before)) {
      ++own_.rejected;
      continue;
    }
    if (!system.project(t_ + h_, y_.data())) {
      status = StepStatus::kNotConverged;
      break;
    }
    ++own_.steps;
    ++since_;
    // A step shortened by an event does not count against the size before.
    if (last) controller_.state.h = std::max(controller_.state.h, std::min(wanted, 2 * asked));
    if (events_) status = end_at_event(system);
    if (status != StepStatus::kDone) break;
    stages_->last_slope(system, t_, h_, y_.data(), last_slope_.data());
    return StepStatus::kDone;
  }
  controller_.state = before;
  series_ = series_before;
  anew_ = was_anew;
  h_ = 0;
  std::swap(x_, y_);
  std::swap(slope_, last_slope_);
  return status;
}

Advance AdaptiveImplicit::advance(OdeSystem& system, double t, double h, std::int64_t /*most*/,
                                  const double* x, double* x_next) {
  // A recalled step is used only if it contains this time.
  if (fresh_ || !(t_ <= t + h && t <= t_ + h_ + 0.01 * (h + h_))) begin(system, t, h, x);
  fresh_ = false;
  const double slack = events_ ? 1e-12 * h : 0;  // of the step that is to end there
  while (t_ + h_ < t + h - slack) {
    if (system.stopped()) return {StepStatus::kStopped};
    if (const StepStatus status = next_step(system, t + h, h); status != StepStatus::kDone) {
      const bool shown = status == StepStatus::kNotFinite || status == StepStatus::kNotAllowed;
      std::copy_n(shown ? x_.data() : x, x_.size(), x_next);
      return {status};
    }
  }
  state_at(system, t + h, x_next);
  since_ = 0;
  if (!events_ && !system.project(t + h, x_next)) return {StepStatus::kNotConverged};
  return {StepStatus::kDone, 1};
}

// out := the state at t, which lies in the present step. Where many steps lie between two states
// one more is cheap.
void AdaptiveImplicit::state_at(OdeSystem& system, double t, double* out) {
  constexpr int kMany = 20;
  if (!(t < t_ + h_)) {
    std::copy_n(y_.data(), y_.size(), out);
    return;
  }
  const PairStep step{h_, x_.span(), slope_.span(), y_.span(), last_slope_.span()};
  if (since_ >= kMany && !events_ && stages_->step_inside(system, t_, t - t_, step, out)) return;
  stages_->interpolate((t - t_) / h_, step, out);
}

// The largest |value_i| / (atol + rtol max(|x_i|, |y_i|)); not a number if one is not finite.
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
  std::vector<double> kept{
      t_, h_, state.h, state.error_before, state.repeated ? 1.0 : 0.0, static_cast<double>(since_)};
  for (const Array* array : {&x_, &y_, &slope_, &last_slope_})
    kept.insert(kept.end(), array->span().begin(), array->span().end());
  if (events_) {
    std::ranges::copy(series_.memory(), std::back_inserter(kept));
    kept.push_back(anew_ ? 1.0 : 0.0);
  }
  const std::vector<double> of_stages = stages_->memory();
  kept.insert(kept.end(), of_stages.begin(), of_stages.end());
  return kept;
}

void AdaptiveImplicit::recall(std::span<const double> memory) {
  constexpr std::size_t kHead = 6;
  const std::size_t size = x_.size(), of_events = events_ ? EventSeries::kMemory + 1 : 0;
  fresh_ = memory.size() < kHead + 4 * size + of_events ||
           !(memory[1] >= 0 && memory[2] > 0 && memory[3] > 0 && memory[5] >= 0);
  if (fresh_) return;
  t_ = memory[0];
  h_ = memory[1];
  controller_.state = {memory[2], memory[3], memory[4] != 0};
  since_ = static_cast<int>(std::min(memory[5], 1e9));
  memory = memory.subspan(kHead);
  for (Array* array : {&x_, &y_, &slope_, &last_slope_}) {
    std::ranges::copy(memory.first(size), array->data());
    memory = memory.subspan(size);
  }
  if (events_) {
    series_ = EventSeries::recalled(memory.data());
    anew_ = memory[EventSeries::kMemory] != 0;
  }
  fresh_ = !stages_->recall(memory.subspan(of_events));
}

Effort AdaptiveImplicit::effort() const { return stages_->effort() + own_; }

}  // namespace sim
