#include "core/ode/explicit/embedded_rk.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/base/finite.h"

namespace sim {
namespace {

constexpr std::size_t kMemoryHead = 5;  // numbers in front of the state

}  // namespace

EmbeddedRungeKutta::EmbeddedRungeKutta(EmbeddedPlan plan, int order, const Tolerance& tolerance)
    : plan_(std::move(plan)), order_(order), tolerance_(tolerance), controller_(order) {}

IntegratorInfo EmbeddedRungeKutta::info() const noexcept {
  return {.order = order_, .evaluations = plan_.stages, .adaptive = true};
}

void EmbeddedRungeKutta::prepare(OdeSystem& system) {
  for (Array* array : {&x_, &x_next_, &y_, &error_, &zero_, &before_})
    *array = Array(system.size());
  stepper_ = system.embedded_stepper(plan_);
  events_ = system.events();
  weights_.resize(plan_.c.size());
  effort_ = {};
  phase_ = Phase::kFresh;
}

Advance EmbeddedRungeKutta::advance(OdeSystem& system, double t, double h, std::int64_t /*most*/,
                                    const double* x, double* x_next) {
  // A recalled step is used only if it contains this time.
  if (phase_ == Phase::kRecalled && !(t_ <= t && t <= t_ + h_ + 0.01 * (h + h_)))
    phase_ = Phase::kFresh;
  if (phase_ == Phase::kFresh && !begin(system, t, x)) {
    const double euler[] = {1};
    combine(x, h, euler, x_next);  // shows where f is not finite
    return {StepStatus::kNotFinite};
  }
  if (phase_ == Phase::kRecalled) {
    if (events_) events_->begin(t_, h_, x_.data());
    stepper_->start(t_, x_.data());
    ++effort_.evaluations;
    try_step();
    if (system.gave_up()) return {StepStatus::kStopped};
    if (!estimate_needs_last()) close_step();
    if (events_) {
      events_->end(t_, h_, x_.data(), x_next_.data(), series_.has_cut());
      events_->repeated();
    }
  }
  phase_ = Phase::kRunning;
  while (t_ + h_ < t + h) {
    if (system.stopped()) return {StepStatus::kStopped};  // goes on from here, with the same bits
    if (const StepStatus status = next_step(system, t + h, x_next); status != StepStatus::kDone)
      return {status};
  }
  interpolate(t + h, x_next);
  if (!system.project(t + h, x_next)) return {StepStatus::kNotFinite};
  if (!all_finite({x_next, x_.size()})) return {StepStatus::kNotFinite};
  return {StepStatus::kDone, 1};
}

// Begins with a step of size 0 that ends in x. False if f(t, x) is not finite.
bool EmbeddedRungeKutta::begin(OdeSystem& system, double t, const double* x) {
  t_ = t;
  h_ = 0;
  std::copy(x, x + x_.size(), x_.data());
  ++effort_.evaluations;
  if (!stepper_->start(t, x_.data())) return false;
  controller_.state = {.h = starting_step(system)};
  series_ = {};
  std::copy(x, x + x_.size(), x_next_.data());
  return true;
}

// The starting step size (Hairer, Norsett & Wanner, Solving ODEs I (1993), section II.4): a step of
// Euler's method estimates the second derivative.
double EmbeddedRungeKutta::starting_step(OdeSystem& system) {
  const double* const x = x_.data();
  double* const k = error_.data();
  const double first[] = {1};
  combine(zero_.data(), 1, first, k);
  const double size = scaled_norm(x, x, x), slope = scaled_norm(k, x, x);
  double h = size < 1e-5 || slope < 1e-5 ? 1e-6 : 0.01 * size / slope;
  if (!(h > 0) || !std::isfinite(h)) h = 1e-6;

  double* const there = x_next_.data();
  const Stage::Term euler{h, k}, less{-1, k};
  system.eval(t_ + h, {x, {&euler, 1}}, y_.data(), there);
  ++effort_.evaluations;
  system.combine({there, {&less, 1}}, there);
  const double curvature = scaled_norm(there, x, x) / h;

  const double most = std::max(slope, curvature);
  if (!std::isfinite(most)) return 1e-3 * h;
  const double wanted =
      most <= 1e-15 ? std::max(1e-6, 1e-3 * h) : power(0.01 / most, 1.0 / (order_ + 1));
  return std::min(100 * h, wanted);
}

// The step after the present one, retried until its error is within the tolerance. A step that is
// given up leaves the one before as the present one, to be recalled.
StepStatus EmbeddedRungeKutta::next_step(OdeSystem& system, double until, double* x_failed) {
  const StepController::State state_before = controller_.state;
  const double t_before = t_, h_before = h_;
  t_ += h_;
  std::swap(before_, x_);
  std::swap(x_, x_next_);
  if (events_) {  // the active events may differ from those at the last end
    events_->begin(t_, controller_.state.h, x_.data());
    stepper_->start(t_, x_.data());
    ++effort_.evaluations;
  } else if (h_ > 0) {
    stepper_->shift();
  }
  extra_ready_ = false;
  for (;;) {
    h_ = controller_.state.h = std::min(controller_.state.h, tolerance_.max_step);
    if (!(t_ + 0.1 * h_ > t_)) {
      std::copy(x_next_.data(), x_next_.data() + x_.size(), x_failed);
      return all_finite(x_next_.span()) ? StepStatus::kStepTooSmall : StepStatus::kNotFinite;
    }
    double error = try_step();
    if (system.gave_up()) {
      std::swap(x_, x_next_);
      std::swap(before_, x_);
      controller_.state = state_before;
      t_ = t_before;
      h_ = h_before;
      phase_ = h_ > 0 ? Phase::kRecalled : Phase::kFresh;
      return StepStatus::kStopped;
    }
    if (error <= 1 && !estimate_needs_last() && !close_step()) error = std::nan("");
    if (controller_.accept(error)) break;
    ++effort_.rejected;
  }
  ++effort_.steps;
  if (events_ && !end_at_event(until)) {
    std::copy(x_next_.data(), x_next_.data() + x_.size(), x_failed);
    return StepStatus::kNotAllowed;
  }
  return StepStatus::kDone;
}

// Repeats the accepted step up to its first event. A step that is not cut ends at the requested
// state at the latest, since there is no dense output across resolved contact.
bool EmbeddedRungeKutta::end_at_event(double until) {
  const bool cut = series_.cuts();
  if (!cut) events_->gave_up();
  const double most = std::min(until - t_, series_.longest());
  if (!cut && h_ > most) {
    h_ = most;
    try_step();
    if (!estimate_needs_last()) close_step();
  }
  bool met = false;
  for (int n = 0; cut && n < Events::kTries; ++n) {
    const double s = events_->first(t_, h_, x_.data(), x_next_.data());
    if (!(s < 1)) break;
    h_ *= s;
    met = true;
    try_step();
    if (!estimate_needs_last()) close_step();
  }
  // The next event may be as near, and a much longer step might miss it; but the step must stay
  // above the rounding of t.
  const double least = 1e6 * std::numeric_limits<double>::epsilon() * std::fabs(t_);
  if (met)
    controller_.state.h = std::min(controller_.state.h, std::max(Events::kLonger * h_, least));
  const EventSeries before = series_;
  series_.add(met, h_);
  const auto outcome = events_->end(t_, h_, x_.data(), x_next_.data(), cut);
  if (outcome != Events::Outcome::kNotAllowed) return true;
  if (!(t_ + h_ > until)) return false;
  // The states up to the requested one may be allowed.
  series_ = before;
  h_ = until - t_;
  events_->begin(t_, h_, x_.data());
  stepper_->start(t_, x_.data());
  ++effort_.evaluations;
  try_step();
  if (!estimate_needs_last()) close_step();
  return end_at_event(until);
}

// Computes x_next and the error of the step, which is nan if x_next is not finite.
double EmbeddedRungeKutta::try_step() {
  const bool finite = stepper_->step(t_, h_, x_.data(), x_next_.data());
  effort_.evaluations += plan_.stages - 1;
  if (estimate_needs_last()) close_step();
  return finite ? scaled_error() : std::nan("");
}

bool EmbeddedRungeKutta::close_step() {
  ++effort_.evaluations;
  return stepper_->close(t_ + h_, x_next_.data());
}

double EmbeddedRungeKutta::scaled_error() {
  const auto norm = [&](const std::vector<double>& weights) {
    combine(zero_.data(), h_, weights, error_.data());
    return scaled_norm(error_.data(), x_.data(), x_next_.data());
  };
  const auto norms = stepper_->error_norms(tolerance_);
  const double fine = norms ? norms->fine : norm(plan_.error);
  if (plan_.coarse.empty() || fine == 0) return fine;
  const double coarse = norms ? norms->coarse : norm(plan_.coarse);
  return fine * (fine / std::sqrt(fine * fine + 0.01 * coarse * coarse));
}

// The largest |value_i| / (atol + rtol max(|x_i|, |y_i|)); nan if one is not finite. A mean would
// change with the number of particles and with the padding of a state, and let one particle be far
// off; the largest also does not depend on the order of summation.
double EmbeddedRungeKutta::scaled_norm(const double* values, const double* x,
                                       const double* y) const {
  constexpr std::size_t kLanes = 8;
  const auto ratio_of = [&](std::size_t i) {
    const double a = std::fabs(x[i]), b = std::fabs(y[i]);
    return std::fabs(values[i]) / (tolerance_.atol + tolerance_.rtol * (a > b ? a : b));
  };
  const std::size_t whole = x_.size() / kLanes * kLanes;
  double largest = 0;
  for (std::size_t i = whole; i < x_.size(); ++i) largest = larger_error(largest, ratio_of(i));
  if (whole > 0) {
    double most[kLanes] = {}, poison[kLanes] = {};
    for (std::size_t i = 0; i < whole; i += kLanes)
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const double ratio = ratio_of(i + lane);
        most[lane] = ratio > most[lane] ? ratio : most[lane];
        poison[lane] += 0 * ratio;
      }
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      largest = larger_error(largest, most[lane] + poison[lane]);
  }
  return std::isfinite(largest) ? largest : std::nan("");
}

// out := the state at t, which lies in the present step.
void EmbeddedRungeKutta::interpolate(double t, double* out) {
  const double theta = (t - t_) / h_;
  if (theta >= 1 || (events_ && theta > Events::kAtEnd)) {
    std::copy(x_next_.data(), x_next_.data() + x_.size(), out);
    return;
  }
  if (!extra_ready_) {
    stepper_->extend(t_, h_, x_.data());
    effort_.evaluations += static_cast<int>(plan_.c.size()) - plan_.stages - 1;
  }
  extra_ready_ = true;
  dense_weights(plan_.stages, plan_.method.b, plan_.dense, theta, weights_);
  combine(x_.data(), h_, weights_, out);
}

// out := base + h sum_i weights_i k_i
void EmbeddedRungeKutta::combine(const double* base, double h, std::span<const double> weights,
                                 double* out) {
  stepper_->combine(x_.data(), h, weights, base, out);
}

std::vector<double> EmbeddedRungeKutta::memory() const {
  if (phase_ == Phase::kFresh) return {};
  const StepController::State& state = controller_.state;
  std::vector<double> memory{t_, h_, state.h, state.error_before, state.repeated ? 1.0 : 0.0};
  memory.insert(memory.end(), x_.data(), x_.data() + x_.size());
  if (events_) std::ranges::copy(series_.memory(), std::back_inserter(memory));
  return memory;
}

void EmbeddedRungeKutta::recall(std::span<const double> memory) {
  phase_ = Phase::kFresh;
  const std::size_t size = kMemoryHead + x_.size();
  if (memory.size() != size + (events_ ? EventSeries::kMemory : 0)) return;
  if (events_) series_ = EventSeries::recalled(memory.data() + size);
  if (!std::ranges::all_of(memory.subspan(1, 3), [](double number) { return number > 0; })) return;
  t_ = memory[0];
  h_ = memory[1];
  controller_.state = {memory[2], memory[3], memory[4] != 0};
  std::copy_n(memory.begin() + kMemoryHead, x_.size(), x_.data());
  extra_ready_ = false;
  phase_ = Phase::kRecalled;
}

}  // namespace sim
