#include "core/study/energy_balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/simd/lanes.h"

namespace sim::study {
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
