#include "cli/view/account.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/study/limits/spectrum.h"
#include "core/study/limits/step_limit.h"

namespace sim::cli {
namespace {

constexpr std::size_t kMostSamples = 2000;
constexpr double kMostDrift = 0.01;  // of the energy in play, as in a verdict

}  // namespace

EnergyAccount::EnergyAccount(Player& player, std::size_t system)
    : player_(&player), index_(system) {
  begin(0);
  sample();
}

std::int64_t EnergyAccount::due() const {
  return balance_ ? std::max<std::int64_t>(1, balance_->due()) : 64;
}

// The work up to the present state, under the velocities that led to it.
void EnergyAccount::look() {
  const std::int64_t now = player_->system(index_).step_count();
  if (balance_ && now > step_) balance_->advance(now - step_);
  step_ = now;
}

void EnergyAccount::begin(double drift) {
  Simulation& system = player_->system(index_);
  step_ = system.step_count();
  touches_ = player_->timeline(index_).touches();
  if (!system.second_order()) return;
  balance_.emplace(system);
  if (!system.settings().held.empty()) balance_->touched(0);
  start_ = player_->timeline(index_).start_energy(system);
  base_ = system.energy().total() - drift;
}

void EnergyAccount::stepped() {
  Simulation& system = player_->system(index_);
  if (system.step_count() < step_) return travelled();
  const bool touched = touches_ != player_->timeline(index_).touches();
  look();
  if (!touched) return;
  touches_ = player_->timeline(index_).touches();
  // What comes later will be other.
  while (!samples_.empty() && samples_.back().step > step_) samples_.pop_back();
  if (!balance_) return;
  const double start = player_->timeline(index_).start_energy(system);
  balance_->touched(start - start_);
  base_ += start - start_;
  start_ = start;
}

void EnergyAccount::travelled() {
  const std::int64_t now = player_->system(index_).step_count();
  double known = 0;
  for (const EnergySample& each : samples_)
    if (each.step <= now) known = each.drift;
  const std::int64_t last = player_->timeline(index_).last();
  std::erase_if(samples_, [&](const EnergySample& each) { return each.step > last; });
  begin(known);
}

double EnergyAccount::drift() {
  return player_->system(index_).energy().total() + balance_->taken() - base_;
}

EnergySample EnergyAccount::sample() {
  Simulation& system = player_->system(index_);
  EnergySample now{.step = system.step_count(), .t = system.t()};
  if (balance_) {
    const Energy energy = system.energy();
    now.kinetic = energy.kinetic;
    now.potential = energy.potential;
    now.drift = drift();
  }
  const auto place = std::ranges::lower_bound(samples_, now.step, {}, &EnergySample::step);
  if (place != samples_.end() && place->step == now.step)
    *place = now;
  else
    samples_.insert(place, now);
  if (samples_.size() <= kMostSamples) return now;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < samples_.size(); ++i)
    if (i % 2 == 0 || i > samples_.size() * 3 / 4) samples_[kept++] = samples_[i];
  samples_.resize(kept);
  return now;
}

std::int64_t EnergyAccount::last_good() const {
  constexpr double kExplosion = 1e6;
  if (!balance_ || samples_.empty()) return -1;
  double in_play = 0;
  std::int64_t good = samples_.front().step;
  for (const EnergySample& each : samples_) {
    const double moved = each.kinetic + std::abs(each.potential - samples_.front().potential);
    if (!(std::abs(each.drift) <= kExplosion * std::max(in_play, 1e-9)) && in_play > 0) return good;
    if (!std::isfinite(each.kinetic + each.potential)) return good;
    if (std::abs(each.drift) > std::max(in_play, moved) / 2) continue;
    in_play = std::max(in_play, moved);
    good = each.step;
  }
  return -1;
}

double stable_share(Simulation& system) {
  const IntegratorInfo info = system.integrator_info();
  if (info.adaptive || !system.second_order()) return std::nan("");
  const study::Vibration fastest = study::fastest_vibration(system);
  return study::step_share(system.integrator(), fastest, system.h()).share;
}

std::string live_verdict(const EnergySample& now, const std::vector<EnergySample>& past,
                         double share, const Simulation& system) {
  if (!system.second_order()) return "";
  double in_play = now.kinetic;
  for (const EnergySample& each : past)
    in_play = std::max(in_play, each.kinetic + std::abs(each.potential - past.front().potential));
  const double off = in_play > 0 ? std::abs(now.drift) / in_play : 0;
  if (share > 1) return "suspect: dt is " + brief(100 * share, 3) + " % of the largest stable step";
  if (off > kMostDrift)
    return "suspect: energy off by " + brief(100 * off, 2) + " % of what is in play";
  return "trusted so far: energy to " + brief(100 * off, 2) + " %";
}

}  // namespace sim::cli
