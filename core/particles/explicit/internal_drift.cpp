#include "core/particles/explicit/internal_drift.h"

namespace sim {

InternalDrift::InternalDrift(const Particles& particles)
    : particles_(&particles), m_(particles.internal_size()) {
  for (Array& k : k_) k = Array(particles.internal_size());
}

void InternalDrift::drift(double t, double tau, double* state) {
  const std::size_t size = particles_->internal_size();
  if (size == 0) return;
  double* const m = state + particles_->layout().size();
  constexpr double kPlace[] = {0, 0.5, 0.5, 1};
  for (int stage = 0; stage < 4; ++stage) {
    for (std::size_t i = 0; i < size; ++i)
      m_[i] = stage == 0 ? m[i] : m[i] + kPlace[stage] * tau * k_[stage - 1][i];
    ParticleView view;
    view.t = t + kPlace[stage] * tau;
    view.internal = m_.span();
    particles_->derive(view, k_[stage].data());
  }
  for (std::size_t i = 0; i < size; ++i)
    m[i] += tau / 6 * (k_[0][i] + 2 * k_[1][i] + 2 * k_[2][i] + k_[3][i]);
}

}  // namespace sim
