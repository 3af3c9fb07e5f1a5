#include "core/study/energy_balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"

namespace sim::study {
namespace {

// Steps from one look at the power to the next, so that looks at large systems take little time.
std::int64_t by_size(const Simulation& system) {
  constexpr int kParticlesPerStep = 2048;
  return std::clamp(system.particles() / kParticlesPerStep, 1, 16);
}

}  // namespace

EnergyBalance::EnergyBalance(Simulation& system, std::int64_t steps)
    : system_(&system), start_(system.energy()), steps_(steps) {
  const ParticleSystem& particles = *particles_of(system);
  for (Force* force : particles.other_forces())
    if (!force->conservative() && !force->springs()) working_.push_back(force);
  acting_.reserve(working_.size());
  kinematic_ = moves_pinned_ = !particles.prescribed().empty();
  driven_ = system.constraint_system() && system.constraint_system()->constraints().move();
  moved_by_colliders_ = particles.contacts().move();
  damped_ = particles.has_damping() || !working_.empty() || driven_ || kinematic_;
  if (damped_) sums_ = Array(Layout(system.particles(), 3).size());
  confined_ = acts_between_steps(system);
  broken_before_ = system.settings().broken_energy;
  slept_before_ = system.sleep().taken;
  contact_before_ = {-system.contact_work().lost, -system.contact_work().given};
  stride_ = by_size(system);
  // Work of forces is sampled at 2 % of the cost of the run but at least 200 times, or at up to 25
  // % if fewer samples do not determine it.
  constexpr std::int64_t kLooks = 200, kShare = 50, kMostShare = 4;
  const std::int64_t each = std::max(1, system.integrator_info().evaluations);
  least_ = most_ = stride_;
  if (!working_.empty()) {
    most_ = std::max(most_, std::clamp<std::int64_t>(steps / kLooks, 1, kShare / each));
    stride_ = least_ = std::clamp<std::int64_t>(kMostShare / each, least_, most_);
  }
  start_potential_ = potential();
  if (damped_) work_.look(system.t(), power());
  in_play_ = start_.kinetic;
}

void EnergyBalance::end_anywhere() {
  stride_ = most_ = least_ = std::min(least_, by_size(*system_));
}

void EnergyBalance::touched(double energy) {
  const ParticleSystem& particles = *particles_of(*system_);
  start_.potential += energy;
  moves_pinned_ = kinematic_ || !system_->settings().held.empty();
  if (damped_) work_.part();
  damped_ = damped_ || moves_pinned_ || particles.has_damping();
  if (!damped_) return;
  if (sums_.size() == 0) sums_ = Array(Layout(system_->particles(), 3).size());
  work_.look(system_->t(), power());
  since_ = 0;
}

// The user who drags a particle, or a prescribed motion, supplies the power -F.v that forces on the
// particle take. If nothing but its motion changes the energy, E' = -F.v, for gravity and drag act
// on free particles only. Forces that do work give back what they take from it.
double EnergyBalance::hands() const {
  const ParticleSystem& particles = *particles_of(*system_);
  const double t = system_->t();
  const ParticleView p = particles.view(t, system_->state().data());
  double power = 0;
  std::vector<Link> links;
  std::vector<int> moved = system_->settings().held;
  moved.insert(moved.end(), particles.prescribed().ids().begin(),
               particles.prescribed().ids().end());
  for (const int i : moved) {
    const Vec3 v = p.velocity(i);
    if (v == Vec3::Zero()) continue;
    power -= particles.motion().damping * v.squaredNorm();  // which was counted for it, too
    Vec3 sum = Vec3::Zero();
    for (Force* force : particles.forces()) {
      if (force->springs()) {
        links.clear();
        force->links(i, links);
        for (const Link& link : links)
          sum += spring_force(link.sense, p.position(i) - p.position(link.to), link.stiffness,
                              link.rest);
      }
      if (std::ranges::count(particles.other_forces(), force) == 0) continue;
      if (std::ranges::count(working_, force) > 0 && !force->has_dissipative_part()) continue;
      std::ranges::fill(sums_.span(), 0.0);
      const auto [fx, fy, fz] = Layout(p.n, 3).axes(sums_.data());
      const ParticleView own = particles.seen_by(*force, p);
      force->prepare(own, particles.pool());
      force->accumulate(own, {i, i + 1}, {fx, fy, fz});
      sum += Vec3(fx[i], fy[i], fz[i]);
      if (!force->has_dissipative_part()) continue;
      std::ranges::fill(sums_.span(), 0.0);
      force->dissipative_part(own, {i, i + 1}, {fx, fy, fz});
      sum -= Vec3(fx[i], fy[i], fz[i]);
    }
    power += sum.dot(v);
  }
  return power;
}

double EnergyBalance::power() const {
  const ParticleSystem& particles = *particles_of(*system_);
  const double t = system_->t();
  double power = particles.damping_power(t, system_->state().data(), sums_);
  if (driven_ || (moves_pinned_ && system_->constraint_system()))
    power -= system_->constraint_system()->driving_power(t, system_->state().data());
  if (const std::span<Force* const> forces = acting(); !forces.empty())
    power = less_work(power, forces);
  if (moves_pinned_) power += hands();
  return power;
}

double EnergyBalance::less_work(double power, std::span<Force* const> forces) const {
  const ParticleSystem& particles = *particles_of(*system_);
  const ParticleView p = particles.view(system_->t(), system_->state().data());
  for (Force* force : forces) force->prepare(particles.seen_by(*force, p), particles.pool());
  std::ranges::fill(sums_.span(), 0.0);
  const auto [fx, fy, fz] = Layout(p.n, 3).axes(sums_.data());
  const ForceSink sink{fx, fy, fz};
  particles.pool().run_parts(p.n, 8, [&](int begin, int end) {
    for (const Force* force : forces) {
      const ParticleView own = particles.seen_by(*force, p);
      if (force->has_dissipative_part())
        force->dissipative_part(own, {begin, end}, sink);
      else
        force->accumulate(own, {begin, end}, sink);
    }
  });
  for (int i = 0; i < p.n; ++i)
    if (p.free(i)) power -= sink.x[i] * p.vx[i] + sink.y[i] * p.vy[i] + sink.z[i] * p.vz[i];
  return power;
}

// Both lists are in the order of the scene.
std::span<Force* const> EnergyBalance::acting() const {
  const std::span<Force* const> others = particles_of(*system_)->other_forces();
  acting_.clear();
  auto next = others.begin();
  for (Force* force : working_) {
    const auto found = std::find(next, others.end(), force);
    if (found == others.end()) continue;
    acting_.push_back(force);
    next = found + 1;
  }
  return acting_;
}

// E' counts this with the other potentials, although no force derives from it.
double EnergyBalance::potential() const {
  const ParticleSystem& particles = *particles_of(*system_);
  const ParticleView p = particles.view(system_->t(), system_->state().data());
  double sum = 0;
  for (Force* force : acting()) {
    if (force->has_dissipative_part()) continue;  // it does come from there
    const ParticleView own = particles.seen_by(*force, p);
    force->prepare(own, particles.pool());
    sum += force->potential(own, {0, p.n});
  }
  return sum;
}

std::int64_t EnergyBalance::due() const {
  return !damped_ ? std::numeric_limits<std::int64_t>::max() : stride_ - since_;
}

void EnergyBalance::advance(std::int64_t steps) {
  since_ += steps;
  if (since_ < stride_) return;
  since_ = 0;
  if (!damped_) return;
  work_.look(system_->t(), power());
  if (least_ < most_) choose_stride();
}

// The pieces of W may be uncertain by a hundredth of what a verdict tolerates, in the whole run.
// The error of a cubic piece grows as the fifth power of its length.
void EnergyBalance::choose_stride() {
  constexpr double kDoubt = 1e-4;  // of the energy in play
  const double allowed =
      kDoubt * in_play_ * static_cast<double>(stride_) / static_cast<double>(steps_);
  if (work_.doubt() > allowed)
    stride_ = std::max(least_, stride_ / 2);
  else if (16 * work_.doubt() <= allowed)
    stride_ = std::min(most_, 2 * stride_);
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
  broken_before_ = slept_before_ = 0;
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
  const double by_contact = contact().lost - contact().given +
                            (system_->settings().broken_energy - broken_before_) +
                            (system_->sleep().taken - slept_before_);
  if (!damped_) return by_contact;
  const double work = since_ == 0 ? work_.value() : work_.with(system_->t(), power());
  const double by_potential = working_.empty() ? 0 : potential() - start_potential_;
  return work - by_potential + by_contact;
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
