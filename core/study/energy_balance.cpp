#include "core/study/energy_balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/simd/lanes.h"

namespace sim::study {
EnergyBalance::EnergyBalance(Simulation& system) : system_(&system), start_(system.energy()) {
  const ParticleSystem& particles = *particles_of(system);
  damping_ = particles.motion().damping;
  complete_ = particles.contacts().empty() &&
              std::ranges::all_of(particles.other_forces(),
                                  [](const Force* force) { return force->conservative(); });
  constexpr int kParticlesPerStep = 2048;
  stride_ = std::clamp(system.particles() / kParticlesPerStep, 1, 16);
  if (damping_ > 0) work_.look(system.t(), power());
  in_play_ = start_.kinetic;
}

// c sum |v|^2: pinned particles have no velocity.
double EnergyBalance::power() const {
  const ParticleView p = particles_of(*system_)->view(system_->t(), system_->state().data());
  return damping_ * sum_in_lanes(0, p.n, [&](int i) {
           return p.vx[i] * p.vx[i] + p.vy[i] * p.vy[i] + p.vz[i] * p.vz[i];
         });
}

std::int64_t EnergyBalance::due() const {
  return damping_ == 0 ? std::numeric_limits<std::int64_t>::max() : stride_ - steps_ % stride_;
}

void EnergyBalance::advance(std::int64_t steps) {
  steps_ += steps;
  if (damping_ > 0 && steps_ % stride_ == 0) work_.look(system_->t(), power());
}

// The energy at the start of the first part is not known here; E + W counts from this state.
bool EnergyBalance::recall(std::span<const double> memory) {
  if (!work_.recall(memory)) return false;
  before_ = taken();
  return true;
}

double EnergyBalance::taken() const {
  if (damping_ == 0) return 0;
  return steps_ % stride_ == 0 ? work_.value() : work_.with(system_->t(), power());
}

void EnergyBalance::look(const Energy& now) {
  const double change = now.total() - start_.total();
  in_play_ = std::max(in_play_, now.kinetic + std::abs(now.potential - start_.potential));
  rise_ = std::max(rise_, change);
  const double error = change + taken() - before_;
  const bool known = damping_ == 0 || work_.settled();
  if (known ? !(std::abs(error) <= std::abs(error_)) : error > std::abs(error_)) error_ = error;
}

}  // namespace sim::study
