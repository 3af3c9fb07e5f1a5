#include "core/study/energy_balance.h"

#include <algorithm>
#include <cmath>

namespace sim::study {

EnergyBalance::EnergyBalance(Simulation& system) : system_(&system), start_(system.energy()) {
  const ParticleSystem& particles = *particles_of(system);
  damping_ = particles.motion().damping;
  for (const auto& force : particles.forces())
    complete_ = complete_ && (force->affine() || force->springs());
  last_t_ = system.t();
  last_power_ = power();
  in_play_ = start_.kinetic;
}

double EnergyBalance::power() const {
  if (damping_ == 0) return 0;
  const ParticleView p = particles_of(*system_)->view(system_->t(), system_->state().data());
  double sum = 0;
  for (int i = 0; i < p.n; ++i)
    if (p.free(i)) sum += p.velocity(i).squaredNorm();
  return damping_ * sum;
}

void EnergyBalance::look() {
  const Energy now = system_->energy();
  in_play_ = std::max(in_play_, now.kinetic + std::abs(now.potential - start_.potential));
  odd_ = !odd_;
  if (odd_ && damping_ > 0) {
    middle_power_ = power();
    return;
  }
  if (damping_ > 0) {
    const double t = system_->t(), last = power();
    taken_ += (t - last_t_) / 6 * (last_power_ + 4 * middle_power_ + last);
    last_t_ = t;
    last_power_ = last;
  }
  const double error = now.total() + taken_ - start_.total();
  if (!(std::abs(error) <= std::abs(error_))) error_ = error;
}

}  // namespace sim::study
