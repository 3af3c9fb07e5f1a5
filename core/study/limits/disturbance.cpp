#include "core/study/limits/disturbance.h"

#include <algorithm>
#include <cmath>

#include "core/base/noise.h"
#include "core/math/elementary.h"

namespace sim::study {
namespace {

constexpr int kSteps = 400;
constexpr double kSize = 1e-7;         // of the disturbance, of the largest coordinate
constexpr double kTooLarge = 1e3;      // growth that is enough to know
constexpr double kMode = 30;           // times the random part, of the fastest mode
constexpr double kOwn = 1.2;           // times the growth found, which is approached from below
constexpr int kLongest = 16 * kSteps;  // for a growth that may be a drift
constexpr double kDrift = 2.1;   // or less: the growth of a drift from half a time to the whole
constexpr double kSlower = 1.5;  // the power to which a growth rises in twice the time, or less

}  // namespace

Disturbance::Disturbance(Standstill& place, const Spectrum& spectrum, const MethodChoice& method)
    : place_(&place),
      weights_(spectrum.weights),
      integrator_(place.problem().with(method).make_integrator()),
      start_(place.state().size()),
      x_(start_.size()),
      next_(start_.size()) {
  own_ = spectrum.growth;
  for (const Vibration& each : spectrum.rates) own_ = std::max(own_, -0.5 * each.damping);
  own_ *= kOwn;
  integrator_->prepare(place.system().ode());
  const StateShape& shape = place.system().shape();
  const StatePart& position = *shape.find("position");
  const StatePart& velocity = *shape.find("velocity");
  double largest = 0;
  for (const double value : place.state()) largest = std::max(largest, std::abs(value));
  std::ranges::copy(place.state(), start_.data());
  Noise noise;
  const double size = kSize * (largest > 0 ? largest : 1);
  const double rate = std::max(spectrum.fastest.omega, 1e-300);
  for (std::size_t i = 0; i < position.count; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t at = position.at(i, axis);
      if (weights_[at] > 0) start_[at] += size * (noise.next() + kMode * spectrum.shape[at]);
      weights_[velocity.at(i, axis)] /= rate * rate;
    }
  // A method of several steps shows its memory after a few of them. Its fastest mode is found in
  // this way alone: the mode stands out, so that little growth shows.
  const double h = 1e-3 / rate;
  integrator_->restart(place.t(), h, start_.data());
  std::ranges::copy(start_.span(), x_.data());
  for (int i = 0; i < 3; ++i) {
    if (integrator_->step(place.system().ode(), place.t() + i * h, h, x_.data(), next_.data()) !=
        StepStatus::kDone)
      return;
    std::swap(x_, next_);
  }
  keeps_steps_ = !integrator_->memory().empty();
}

double Disturbance::size_of(const Array& x) const {
  double sum = 0;
  const std::span<const double> rest = place_->state();
  for (std::size_t i = 0; i < weights_.size(); ++i)
    if (weights_[i] > 0) sum += weights_[i] * (x[i] - rest[i]) * (x[i] - rest[i]);
  return std::sqrt(sum);
}

// Particles that nothing holds, as on the surface of a fluid, drift away as 1 + c t, at whatever
// step. From half a time to the whole that grows by at most 2, and in twice the time by little
// more; e^(c t) grows by the square.
double Disturbance::operator()(double h) {
  auto [growth, ratio] = growth_in(kSteps, h);
  if (growth <= 1 + tolerance()) return growth;
  for (int steps = 2 * kSteps; ratio <= kDrift && steps <= kLongest; steps *= 2) {
    const double longer = growth_in(steps, h).ratio;
    if (longer < elementary::pow(ratio, kSlower)) return 1;
    ratio = longer;
  }
  return growth;
}

Disturbance::Grown Disturbance::growth_in(int steps, double h) {
  integrator_->restart(place_->t(), h, start_.data());
  std::ranges::copy(start_.span(), x_.data());
  const double first = size_of(x_);
  double early = 0, late = 0;
  for (int step = 1; step <= steps; ++step) {
    if (place_->system().ode().stopped()) return {HUGE_VAL, HUGE_VAL};
    const double t = place_->t() + (step - 1) * h;
    if (integrator_->step(place_->system().ode(), t, h, x_.data(), next_.data()) !=
        StepStatus::kDone)
      return {HUGE_VAL, HUGE_VAL};
    std::swap(x_, next_);
    const double size = size_of(x_);
    if (!std::isfinite(size)) return {HUGE_VAL, HUGE_VAL};
    if (size > kTooLarge * first)
      return {elementary::pow(size / first, 1.0 / step) / elementary::exp(own_ * h), HUGE_VAL};
    if (step > steps / 4 && step <= steps / 2) early = std::max(early, size);
    if (step > steps * 3 / 4) late = std::max(late, size);
  }
  if (early == 0) return {1, 1};
  const double ratio = late / early;
  return {elementary::pow(ratio, 2.0 / steps) / elementary::exp(own_ * h), ratio};
}

double limit_by_disturbance(Disturbance& growth, double limit) {
  constexpr double kInside = 0.98, kFactor = 1.5, kLeast = 1e-7, kExact = 1e-4;
  const auto stable = [&](double h) { return growth(h) <= 1 + Disturbance::kTolerance; };
  double high = kInside * limit;
  if (!(limit > 0) || std::isinf(limit) || stable(high)) return limit;
  double low = high / kFactor;
  while (!stable(low)) {
    high = low;
    low /= kFactor;
    if (low < kLeast * limit) return 0;
  }
  while (high - low > kExact * low) {
    const double middle = 0.5 * (low + high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace sim::study
