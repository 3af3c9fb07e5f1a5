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
constexpr double kLater = 8.3;         // steps, until forces of time have changed
constexpr double kDrift = 2.1;   // or less: the growth of a drift from half a time to the whole
constexpr double kSlower = 1.5;  // the power to which a growth rises in twice the time, or less

}  // namespace

Disturbance::Disturbance(Standstill& place, const Spectrum& spectrum, const MethodChoice& method)
    : place_(&place),
      method_(method),
      weights_(spectrum.weights),
      start_(place.state().size()),
      disturbed_(course()) {
  own_ = spectrum.growth;
  for (const Vibration& each : spectrum.rates) own_ = std::max(own_, -0.5 * each.damping);
  own_ *= kOwn;
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
  if (forces_change()) undisturbed_ = course();
  // A method of several steps shows its memory after a few of them. Its fastest mode is found in
  // this way alone: the mode stands out, so that little growth shows.
  const double h = 1e-3 / rate;
  begin(disturbed_, start_.span(), h);
  for (int i = 0; i < 3; ++i)
    if (!step(disturbed_, i, h)) return;
  keeps_steps_ = !disturbed_.integrator->memory().empty();
}

Disturbance::Course Disturbance::course() const {
  Course made{place_->problem().with(method_).make_integrator(), Array(start_.size()),
              Array(start_.size())};
  made.integrator->prepare(place_->system().ode());
  return made;
}

void Disturbance::begin(Course& course, std::span<const double> x, double h) const {
  course.integrator->restart(place_->t(), h, x.data());
  std::ranges::copy(x, course.x.data());
}

bool Disturbance::step(Course& course, int step, double h) const {
  OdeSystem& ode = place_->system().ode();
  const double t = place_->t() + step * h;
  if (course.integrator->step(ode, t, h, course.x.data(), course.next.data()) != StepStatus::kDone)
    return false;
  std::swap(course.x, course.next);
  return true;
}

// The loads that hold the system are those of its time; what changes with time alone moves it.
bool Disturbance::forces_change() const {
  OdeSystem& ode = place_->system().ode();
  const double* const rest = place_->state().data();
  Array point(start_.size()), now(start_.size()), later(start_.size());
  ode.eval(place_->t(), {rest, {}}, point.data(), now.data());
  ode.eval(place_->t() + kLater * place_->system().h(), {rest, {}}, point.data(), later.data());
  return !std::ranges::equal(now.span(), later.span());
}

double Disturbance::size_of(std::span<const double> x, std::span<const double> from) const {
  double sum = 0;
  for (std::size_t i = 0; i < weights_.size(); ++i)
    if (weights_[i] > 0) sum += weights_[i] * (x[i] - from[i]) * (x[i] - from[i]);
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
  constexpr Grown kFails{HUGE_VAL, HUGE_VAL};
  begin(disturbed_, start_.span(), h);
  if (undisturbed_) begin(*undisturbed_, place_->state(), h);
  const double first = size_of(start_.span(), place_->state());
  double early = 0, late = 0;
  for (int i = 1; i <= steps; ++i) {
    if (place_->system().ode().stopped() || !step(disturbed_, i - 1, h)) return kFails;
    if (undisturbed_ && !step(*undisturbed_, i - 1, h)) return kFails;
    const double size =
        size_of(disturbed_.x.span(), undisturbed_ ? undisturbed_->x.span() : place_->state());
    if (!std::isfinite(size)) return kFails;
    if (size > kTooLarge * first)
      return {elementary::pow(size / first, 1.0 / i) / elementary::exp(own_ * h), HUGE_VAL};
    if (i > steps / 4 && i <= steps / 2) early = std::max(early, size);
    if (i > steps * 3 / 4) late = std::max(late, size);
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
