#include "core/study/verdict/verdict.h"

#include <algorithm>
#include <cmath>

#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr double kExplosion = 1e6;
constexpr double kMostlyWrong = 0.5;  // an error, of the energy in play

std::string joined(const std::vector<Finding>& findings, Trust trust, std::string_view separator) {
  std::string text;
  for (const Finding& finding : findings) {
    if (finding.trust != trust) continue;
    if (!text.empty()) text += separator;
    text += finding.words;
  }
  return text;
}

}  // namespace

const char* trust_name(Trust trust) {
  constexpr const char* kNames[] = {"trusted", "unverified", "chaotic", "suspect", "diverged"};
  return kNames[static_cast<int>(trust)];
}

Deviation deviation(const SystemSpec& spec, const Simulation& system) {
  const StatePart& part = system.shape().first();
  const std::size_t axes = part.components.size(), numbers = part.count * axes;
  const std::vector<double> exact = spec.exact(system.t());
  if (exact.size() != numbers) return {std::nan(""), 0};
  Deviation result;
  for (std::size_t i = 0; i < numbers; ++i) {
    const double value = system.state()[part.at(i / axes, i % axes)];
    const double error = std::abs(value - exact[i]);
    result.error = larger_error(error, result.error);
    result.size = std::max(result.size, std::abs(exact[i]));
  }
  return result;
}

namespace {

double largest(const Simulation& system) {
  double most = 0;
  for (const double each : system.state()) most = std::max(most, std::abs(each));
  return most;
}

// J, of the heaviest particle that crosses the scene in its duration: what is given to a scene at
// rest is compared with that, not with the little that comes first.
double crossing_energy(Simulation& system) {
  if (!(system.duration() > 0)) return 0;
  double heaviest = 0;
  for (const double mass : particles_of(system)->masses())
    if (std::isfinite(mass)) heaviest = std::max(heaviest, mass);
  const double speed = scene_size(system) / system.duration();
  return 0.5 * heaviest * speed * speed;
}

}  // namespace

Monitor::Monitor(const SystemSpec& spec, Simulation& system, std::int64_t steps, Registry* registry)
    : system_(&system) {
  if (system.second_order()) {
    start_ = system.energy();
    balance_ = std::make_unique<EnergyBalance>(system, steps);
  }
  start_size_ = largest(system);
  const Watched run{spec, system, steps, registry, balance_.get()};
  for (const auto watch :
       {watch_kernels, watch_forces, watch_exact, watch_energy, watch_limit, watch_strain,
        watch_cells, watch_single_steps, watch_momentum, watch_contact, watch_constraints,
        watch_crossings, watch_breaking, watch_sleep})
    if (auto criterion = watch(run)) criteria_.push_back(std::move(criterion));
}

Monitor::~Monitor() = default;
Monitor::Monitor(Monitor&&) noexcept = default;
Monitor& Monitor::operator=(Monitor&&) noexcept = default;

// Momentum is not conserved once the user has dragged a particle.
void Monitor::touched(double energy) {
  for (const auto& criterion : criteria_) criterion->touched();
  looked_ = -1;
  if (!balance_) return;
  balance_->touched(energy);
  start_.potential += energy;
  touched_ = true;
}

void Monitor::look(const Energy* energy) {
  looked_ = system_->step_count();
  if (energy) {
    highest_ = std::max(highest_, energy->total() - start_.total());
    const double moving = energy->kinetic + std::abs(energy->potential - start_.potential);
    if (start_scale_ == 0 && moving > 0)
      start_scale_ = std::max(moving + start_.kinetic + std::abs(start_.potential),
                              balance_->is_driven() ? crossing_energy(*system_) : 0);
  }
  for (const auto& criterion : criteria_) criterion->look(energy);
  if (balance_)
    sound_ = !(std::abs(balance_->error()) > kMostlyWrong * balance_->in_play()) && !exploded();
  else
    sound_ = start_size_ == 0 || largest(*system_) <= kExplosion * start_size_;
}

// Energy supplied by forces that do work, or by motion that is given, is no explosion.
bool Monitor::exploded() const {
  const bool given = balance_ && balance_->is_driven() &&
                     !(balance_->error() > kMostlyWrong * balance_->in_play());
  return !given && start_scale_ > 0 && highest_ > kExplosion * start_scale_;
}

void Monitor::look_at_present() {
  if (looked_ == system_->step_count()) return;
  if (!balance_) return look(nullptr);
  if (const Energy energy = system_->energy(); std::isfinite(energy.total())) look(&energy);
}

Verdict Monitor::verdict(const RunDeviation& deviation) {
  look_at_present();
  Verdict verdict;
  verdict.figures.shadow = deviation;
  verdict.figures.strain = deviation.strain;
  std::vector<Finding> findings;
  findings.push_back(finding_of(deviation, *system_));
  for (const auto& criterion : criteria_) criterion->conclude(verdict.figures, findings);
  if (touched_ && verdict.figures.momentum > 0) {
    verdict.figures.momentum = std::nan("");
    std::erase_if(findings,
                  [](const Finding& each) { return each.words.starts_with("momentum changed"); });
  }
  const bool right = deviation.verified() && findings.front().trust == Trust::kTrusted;
  if (exploded() && !right) {
    verdict.trust = Trust::kDiverged;
    verdict.reason = "energy rose by " + brief(highest_, 3) + " J, from " + brief(start_scale_, 3) +
                     " J at the start: the step is unstable";
    return verdict;
  }

  // A confirmed finding outweighs a presumed error.
  std::erase_if(findings, [&](const Finding& finding) {
    return finding.words.empty() || (finding.presumed && right);
  });
  for (const Finding& finding : findings) verdict.trust = std::max(verdict.trust, finding.trust);
  // If positions are right for a while only, the reader wants to know what is right after that.
  verdict.reason = joined(findings, verdict.trust, verdict.trust == Trust::kSuspect ? "; " : ", ");
  if (verdict.trust == Trust::kChaotic)
    if (const std::string well = joined(findings, Trust::kTrusted, ", "); !well.empty())
      verdict.reason += "; " + well;
  if (findings.empty()) {
    verdict.trust = Trust::kSuspect;
    verdict.reason = "not verified: all numbers stayed finite, nothing else was checked";
  }
  return verdict;
}

}  // namespace sim::study
