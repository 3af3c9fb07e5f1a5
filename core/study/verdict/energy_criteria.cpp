// The balance of energy, and the momentum where it must hold.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/noise.h"
#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/energy_balance.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr double kMomentum = 1e-9;
constexpr double kRounding = 1e-15, kNoWay = 1e-6;  // of the energies; of the size

double relative(double part, double whole) { return whole > 0 ? std::abs(part) / whole : 0; }

double free_mass(Simulation& system) {
  const ParticleView p = particles_of(system)->view(system.t(), system.state().data());
  double mass = 0;
  for (int i = 0; i < p.n; ++i) mass += p.free_mass(i);
  return mass;
}

// The rounding uncertainty of the energy, J: the difference between states that are a rounding
// error apart. Terms may be far larger than their sum, as those of an elastic law at rest.
double rounding_of_energy(Simulation& system) {
  constexpr int kStates = 4;
  const ParticleSystem& particles = *particles_of(system);
  const auto energy_at = [&](const Array& x) {
    return particles.kinetic_energy(system.t(), x.data()) +
           particles.potential_energy(system.t(), x.data());
  };
  Array x(system.state().size());
  std::ranges::copy(system.state(), x.data());
  const double energy = energy_at(x);
  const StatePart& position = *system.shape().find("position");
  Noise noise;
  double most = 0;
  for (int k = 0; k < kStates; ++k) {
    for (std::size_t i = 0; i < position.count; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t at = position.at(i, axis);
        x[at] =
            system.state()[at] * (1 + 2 * std::numeric_limits<double>::epsilon() * noise.next());
      }
    most = std::max(most, std::abs(energy_at(x) - energy));
  }
  return most;
}

class EnergyCriterion final : public Criterion {
 public:
  explicit EnergyCriterion(const Watched& run)
      : system_(&run.system),
        balance_(*run.balance),
        size_(scene_size(run.system)),
        mass_(free_mass(run.system)),
        start_t_(run.system.t()) {}

  void look(const Energy* energy) override {
    if (started_) balance_.look(*energy);
    started_ = true;
    largest_ = std::max(largest_, energy->kinetic + std::abs(energy->potential));
    kinetic_ = std::max(kinetic_, energy->kinetic);
  }

  void conclude(Figures& figures, std::vector<Finding>& findings) override {
    if (std::isfinite(balance_.uncertainty()))
      figures.energy =
          relative(std::abs(balance_.error()) + balance_.uncertainty(), balance_.in_play());
    findings.push_back(finding(figures.shadow));
  }

 private:
  Finding finding(const RunDeviation& shadow) const;

  Simulation* system_;
  EnergyBalance& balance_;
  double size_, mass_, start_t_;  // m, kg, s
  double largest_ = 0;            // J, |E| as the sum of its parts
  double kinetic_ = 0;            // J, the largest
  bool started_ = false;
};

Finding EnergyCriterion::finding(const RunDeviation& shadow) const {
  const double scale = balance_.in_play(), error = balance_.error();
  const std::string whole = brief(scale, 3) + " J in play";
  if (balance_.has_work() && system_->integrator_info().adaptive)
    return {Trust::kTrusted, "energy not checked: forces do work between the states"};
  // The energy in play may be below the rounding error of the energies, and the motion below that
  // of the coordinates. Both are fine for a system at rest.
  const auto way_of = [&](double energy) {
    return std::sqrt(2 * energy / mass_) * (system_->t() - start_t_);
  };
  const double way = way_of(scale);
  // A system standing on something sinks in by rounding errors, which velocities do not show.
  constexpr double kSunk = 1e-9;
  const bool sunk = scale <= kSunk * largest_ && way_of(kinetic_) <= kAtRest * size_;
  if (way <= kAtRest * size_ || sunk) return {Trust::kTrusted, "hardly anything moves"};
  const double size = std::abs(error), unknown = balance_.uncertainty();
  if (kRounding * largest_ > kTolerance * scale) {
    if (!(way > kNoWay * size_)) return {Trust::kTrusted, "hardly anything moves"};
    return {Trust::kSuspect, "energies of " + brief(largest_, 3) + " J round away the " + whole,
            true};
  }
  // The terms may cancel in the sum; then only the kinetic energy measures the motion.
  if (size > kTolerance * scale && rounding_of_energy(*system_) > kTolerance * scale) {
    if (!(way_of(kinetic_) > kNoWay * size_)) return {Trust::kTrusted, "hardly anything moves"};
    return {Trust::kSuspect, "roundings of the energy are as large as the " + whole, true};
  }
  if (!(size - unknown > kTolerance * scale) && size + unknown > kTolerance * scale) {
    // Wind may add energy; drag only takes it.
    if (balance_.has_work())
      return {Trust::kTrusted, "energy not checked: what forces did is not known well enough"};
    const std::string rise = "energy rose by at most " + percent(balance_.rise(), scale);
    const std::string rest = ", what drag took not checked";
    if (!(balance_.rise() > kTolerance * scale)) return {Trust::kTrusted, rise + rest};
    return {Trust::kSuspect, rise + " of the " + whole + rest, true};
  }
  if (size <= kTolerance * scale) return {Trust::kTrusted, "energy to " + percent(size, scale, 1)};
  // States far apart do not determine the work of drag between them; only then may it be a false
  // alarm.
  const bool drag = balance_.has_drag(), contact = acts_between_steps(*system_);
  constexpr double kNegligible = 1e3;
  const IntegratorInfo info = system_->integrator_info();
  const bool hardly = at_rest(info) > kAtRest && way <= kNegligible * at_rest(info) * size_;
  const bool presumed = hardly || (drag && (info.adaptive || balance_.has_work()));
  // If a shorter step has the same error, the step is not the cause, unless the method damps.
  constexpr double kSame = 0.25;
  const bool of_forces = !drag && !contact && !info.implicit &&
                         !particles_of(*system_)->other_forces().empty() &&
                         shadow.energy * scale < kSame * size;
  const std::string cause =
      of_forces ? "; no step mends it: some potential jumps, or is not that of its force" : "";
  const std::string damping = balance_.has_work() ? "forces" : "drag";
  const std::string between = system_->breaks() ? "contact and what broke" : "contact";
  const std::string taker = drag && contact ? damping + " and " + between
                            : drag          ? damping
                                            : between;
  if (error > 0)
    return {Trust::kSuspect,
            "energy rose by " + brief(error, 3) + " J, " + percent(error, scale) + " of the " +
                whole + (drag || contact ? ", above what " + taker + " left" : "") + cause,
            presumed};
  return {Trust::kSuspect,
          "energy fell by " + brief(-error, 3) + " J, " + percent(-error, scale) + " of the " +
              whole +
              (drag || contact ? ", below what " + taker + " left"
               : of_forces     ? cause
                               : ", and no force takes any"),
          presumed};
}

Vec3 momentum(Simulation& system) {
  const ParticleView p = particles_of(system)->view(system.t(), system.state().data());
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < p.n; ++i)
    if (p.free(i)) sum += p.mass[i] * p.velocity(i);
  return sum;
}

// P - P(0) - M g t| over the largest possible momentum, if nothing holds or brakes the particles.
class MomentumCriterion final : public Criterion {
 public:
  explicit MomentumCriterion(const Watched& run)
      : system_(&run.system),
        start_(momentum(run.system)),
        mass_(free_mass(run.system)),
        start_t_(run.system.t()),
        start_potential_(run.system.energy().potential) {}

  void look(const Energy* energy) override {
    in_play_ = std::max(in_play_, energy->kinetic + std::abs(energy->potential - start_potential_));
  }

  void conclude(Figures& figures, std::vector<Finding>& findings) override {
    const double* g = particles_of(*system_)->motion().gravity;
    const Vec3 expected = start_ + mass_ * (system_->t() - start_t_) * Vec3(g[0], g[1], g[2]);
    const double scale = std::sqrt(2 * mass_ * in_play_) + expected.norm();
    figures.momentum = relative((momentum(*system_) - expected).norm(), scale);
    if (figures.momentum > kMomentum)
      findings.push_back(
          {Trust::kSuspect,
           "momentum changed by " + percent(figures.momentum) + " where it must hold",
           system_->integrator_info().precision == Precision::kSingle});
  }

 private:
  Simulation* system_;
  Vec3 start_;                               // kg m/s
  double mass_, start_t_, start_potential_;  // kg, s, J
  double in_play_ = 0;                       // J
};

}  // namespace

std::unique_ptr<Criterion> watch_energy(const Watched& run) {
  if (!run.system.second_order()) return nullptr;
  return std::make_unique<EnergyCriterion>(run);
}

std::unique_ptr<Criterion> watch_momentum(const Watched& run) {
  if (!run.system.conserves_energy() || run.system.pinned_count() > 0 ||
      run.system.constraint_system())
    return nullptr;
  return std::make_unique<MomentumCriterion>(run);
}

}  // namespace sim::study
