#include "core/study/energy_balance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/simd/lanes.h"

namespace sim::study {
namespace {

// The polynomial through the nodes at `at` (Neville 1934).
double interpolated(std::span<const double> t, std::span<const double> values, double at) {
  double p[4];
  std::ranges::copy(values, p);
  for (std::size_t width = 1; width < t.size(); ++width)
    for (std::size_t i = 0; i + width < t.size(); ++i)
      p[i] = ((at - t[i + width]) * p[i] - (at - t[i]) * p[i + 1]) / (t[i] - t[i + width]);
  return p[0];
}

// Its integral from `from` to `to`; Gauss's rule of two points is exact for cubics.
double integral(std::span<const double> t, std::span<const double> values, double from, double to) {
  const double middle = 0.5 * (from + to), half = 0.5 * (to - from), node = half / std::sqrt(3.0);
  return half * (interpolated(t, values, middle - node) + interpolated(t, values, middle + node));
}

}  // namespace

void WorkIntegral::look(double t, double power) {
  if (looks_ >= kNodes) {
    std::shift_left(std::begin(t_), std::end(t_), 1);
    std::shift_left(std::begin(power_), std::end(power_), 1);
  }
  const auto count = static_cast<std::size_t>(std::min<std::int64_t>(++looks_, kNodes));
  t_[count - 1] = t;
  power_[count - 1] = power;
  if (count < 2) return;
  const std::span<const double> times(t_, count), powers(power_, count);
  // The first pieces are taken anew until there are enough looks for a cubic.
  if (looks_ <= kNodes)
    value_ = integral(times, powers, t_[0], t);
  else
    value_ += integral(times, powers, t_[count - 2], t);
  if (looks_ <= 3)
    by_parabolas_ = integral(times, powers, t_[0], t);
  else
    by_parabolas_ += integral(times.last(3), powers.last(3), t_[count - 2], t);
}

double WorkIntegral::with(double t, double power) const {
  WorkIntegral next = *this;
  next.look(t, power);
  return next.value();
}

double WorkIntegral::uncertainty() const {
  constexpr int kEnough = 7;
  return looks_ < kEnough ? HUGE_VAL : 2 * std::abs(value_ - by_parabolas_);
}

EnergyBalance::EnergyBalance(Simulation& system) : system_(&system), start_(system.energy()) {
  const ParticleSystem& particles = *particles_of(system);
  damping_ = particles.motion().damping;
  for (const auto& force : particles.forces())
    complete_ = complete_ && (force->affine() || force->springs());
  constexpr int kParticlesPerStep = 2048;
  stride_ = std::clamp(system.particles() / kParticlesPerStep, 1, 16);
  if (damping_ > 0) work_.look(system.t(), power());
  in_play_ = start_.kinetic;
}

// c sum |v|^2: pinned particles have no velocity.
double EnergyBalance::power() const {
  const Layout& layout = particles_of(*system_)->layout();
  const auto v = layout.axes(system_->state().data(), 3);
  return damping_ * sum_in_lanes(0, layout.n(), [&](int i) {
           return v[0][i] * v[0][i] + v[1][i] * v[1][i] + v[2][i] * v[2][i];
         });
}

std::int64_t EnergyBalance::due() const {
  return damping_ == 0 ? std::numeric_limits<std::int64_t>::max() : stride_ - steps_ % stride_;
}

void EnergyBalance::advance(std::int64_t steps) {
  steps_ += steps;
  if (damping_ > 0 && steps_ % stride_ == 0) work_.look(system_->t(), power());
}

double EnergyBalance::taken() const {
  if (damping_ == 0) return 0;
  return steps_ % stride_ == 0 ? work_.value() : work_.with(system_->t(), power());
}

void EnergyBalance::look(const Energy& now) {
  const double change = now.total() - start_.total();
  in_play_ = std::max(in_play_, now.kinetic + std::abs(now.potential - start_.potential));
  rise_ = std::max(rise_, change);
  const double error = change + taken();
  const bool known = damping_ == 0 || work_.settled();
  if (known ? !(std::abs(error) <= std::abs(error_)) : error > std::abs(error_)) error_ = error;
}

}  // namespace sim::study
