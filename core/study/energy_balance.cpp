#include "core/study/energy_balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sim::study {

EnergyBalance::EnergyBalance(Simulation& system) : system_(&system), start_(system.energy()) {
  const ParticleSystem& particles = *particles_of(system);
  damped_ = particles.has_damping();
  if (damped_) sums_ = Array(Layout(system.particles(), 3).size());
  complete_ = particles.contacts().empty() &&
              std::ranges::all_of(particles.other_forces(),
                                  [](const Force* force) { return force->springs() != nullptr; });
  constexpr int kParticlesPerStep = 2048;
  stride_ = std::clamp(system.particles() / kParticlesPerStep, 1, 16);
  t_[0] = system.t();
  power_[0] = power();
  in_play_ = start_.kinetic;
}

double EnergyBalance::power() {
  return particles_of(*system_)->damping_power(system_->t(), system_->state().data(), sums_);
}

double EnergyBalance::uncertainty() const {
  if (damped_ && pairs_ < 3) return HUGE_VAL;
  return 2 * std::abs(taken_ - taken_by_trapezoids_);
}

std::int64_t EnergyBalance::due() const {
  return !damped_ ? std::numeric_limits<std::int64_t>::max() : stride_ - steps_ % stride_;
}

void EnergyBalance::advance(std::int64_t steps) {
  steps_ += steps;
  if (!damped_ || steps_ % stride_ != 0) return;
  const double t = system_->t(), now = power();
  if (!open_) {
    t_[1] = t;
    power_[1] = now;
  } else {
    // The parabola through three looks, a and b apart.
    const double a = t_[1] - t_[0], b = t - t_[1];
    taken_ +=
        (a + b) / 6 *
        ((2 - b / a) * power_[0] + (a + b) * (a + b) / (a * b) * power_[1] + (2 - a / b) * now);
    taken_by_trapezoids_ += 0.5 * (a * (power_[0] + power_[1]) + b * (power_[1] + now));
    t_[0] = t;
    power_[0] = now;
    ++pairs_;
  }
  open_ = !open_;
}

void EnergyBalance::look(const Energy& now) {
  const double change = now.total() - start_.total();
  in_play_ = std::max(in_play_, now.kinetic + std::abs(now.potential - start_.potential));
  rise_ = std::max(rise_, change);
  const double error = change + taken_;
  const bool whole = !damped_ || t_[0] == system_->t();
  if (whole ? !(std::abs(error) <= std::abs(error_)) : error > std::abs(error_)) error_ = error;
}

}  // namespace sim::study
