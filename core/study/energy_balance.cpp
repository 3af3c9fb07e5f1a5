#include "core/study/energy_balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sim::study {

EnergyBalance::EnergyBalance(Simulation& system) : system_(&system), start_(system.energy()) {
  const ParticleSystem& particles = *particles_of(system);
  damped_ = particles.has_damping();
  if (damped_) sums_ = Array(Layout(system.particles(), 3).size());
  confined_ = !particles.contacts().empty();
  contact_before_ = {-system.contact_work().lost, -system.contact_work().given};
  complete_ = std::ranges::all_of(particles.other_forces(), [](const Force* force) {
    return force->conservative() || force->springs();
  });
  constexpr int kParticlesPerStep = 2048;
  stride_ = std::clamp(system.particles() / kParticlesPerStep, 1, 16);
  if (damped_) work_.look(system.t(), power());
  in_play_ = start_.kinetic;
}

double EnergyBalance::power() const {
  return particles_of(*system_)->damping_power(system_->t(), system_->state().data(), sums_);
}

std::int64_t EnergyBalance::due() const {
  return !damped_ ? std::numeric_limits<std::int64_t>::max() : stride_ - steps_ % stride_;
}

void EnergyBalance::advance(std::int64_t steps) {
  steps_ += steps;
  if (damped_ && steps_ % stride_ == 0) work_.look(system_->t(), power());
}

// The energy at the start of the first part is not known here; E + W counts from this state.
bool EnergyBalance::recall(std::span<const double> memory) {
  if (confined_) {
    if (memory.size() < 2) return false;
    contact_before_.lost += memory[memory.size() - 2];
    contact_before_.given += memory.back();
    memory = memory.first(memory.size() - 2);
  }
  if (!work_.recall(memory)) return false;
  before_ = taken();
  return true;
}

std::vector<double> EnergyBalance::memory() const {
  std::vector<double> numbers = work_.memory();
  if (confined_) numbers.insert(numbers.end(), {contact().lost, contact().given});
  return numbers;
}

ContactWork EnergyBalance::contact() const {
  const ContactWork now = system_->contact_work();
  return {now.lost + contact_before_.lost, now.given + contact_before_.given};
}

double EnergyBalance::taken() const {
  const double by_contact = contact().lost - contact().given;
  if (!damped_) return by_contact;
  return (steps_ % stride_ == 0 ? work_.value() : work_.with(system_->t(), power())) + by_contact;
}

void EnergyBalance::look(const Energy& now) {
  const double change = now.total() - start_.total();
  in_play_ = std::max(in_play_, now.kinetic + std::abs(now.potential - start_.potential));
  rise_ = std::max(rise_, change);
  const double error = change + taken() - before_;
  const bool known = !damped_ || work_.settled();
  if (known ? !(std::abs(error) <= std::abs(error_)) : error > std::abs(error_)) error_ = error;
}

}  // namespace sim::study
