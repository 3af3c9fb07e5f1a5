#include "cli/view/account.h"

#include <algorithm>
#include <cmath>

#include "core/study/limits/spectrum.h"
#include "core/study/limits/step_limit.h"

namespace sim::cli {
namespace {

constexpr std::size_t kMostSamples = 2000;
constexpr std::int64_t kLeastSteps = 1000;  // that a verdict is about
constexpr double kRarely = 20;              // times its cost, between two samples
constexpr double kOften = 0.1;              // s, at most

std::chrono::steady_clock::time_point after(std::chrono::steady_clock::time_point begin) {
  const auto now = std::chrono::steady_clock::now();
  const double cost = std::chrono::duration<double>(now - begin).count();
  return now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                   std::chrono::duration<double>(std::max(kOften, kRarely * cost)));
}

}  // namespace

EnergyAccount::EnergyAccount(Player& player, std::size_t system, const SystemSpec& spec,
                             Registry& registry)
    : player_(&player), index_(system), spec_(&spec), registry_(&registry) {
  begin(0);
  sample();
}

std::int64_t EnergyAccount::due() const { return std::clamp<std::int64_t>(monitor_->due(), 1, 64); }

// The work up to the present state, under the velocities that led to it.
void EnergyAccount::look() {
  const std::int64_t now = player_->system(index_).step_count();
  if (now > step_) monitor_->advance(now - step_);
  step_ = now;
}

void EnergyAccount::begin(double drift) {
  Simulation& system = player_->system(index_);
  step_ = system.step_count();
  touches_ = player_->timeline(index_).touches();
  const std::int64_t steps = std::max(kLeastSteps, system.steps_for(system.duration()));
  monitor_ = std::make_unique<study::Monitor>(*spec_, system, steps, registry_);
  judged_ = -1;
  checked_ = judging_ = {};
  if (!system.second_order()) return;
  if (touches_ > 0 || !system.settings().held.empty()) monitor_->touched(0);
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
  // Later samples are no longer valid.
  while (!samples_.empty() && samples_.back().step > step_) samples_.pop_back();
  if (!system.second_order()) return;
  const double start = player_->timeline(index_).start_energy(system);
  monitor_->touched(start - start_);
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

EnergySample EnergyAccount::sample() {
  Simulation& system = player_->system(index_);
  EnergySample now{.step = system.step_count(), .t = system.t()};
  if (system.second_order()) {
    const Energy energy = system.energy();
    now.kinetic = energy.kinetic;
    now.potential = energy.potential;
    now.drift = energy.total() + monitor_->work() - base_;
    check(energy);
  } else {
    check({});
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
  if (!player_->system(index_).second_order() || samples_.empty()) return -1;
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
  const study::Vibration fastest = study::limiting_vibration(system);
  return study::step_share(system.integrator(), fastest, system.h()).share;
}

void EnergyAccount::check(const Energy& energy) {
  const auto now = Clock::now();
  if (now < checked_ || !std::isfinite(energy.total())) return;
  monitor_->look(player_->system(index_).second_order() ? &energy : nullptr);
  checked_ = after(now);
}

const study::Verdict& EnergyAccount::verdict(const study::RunDeviation& parted) {
  const auto now = Clock::now();
  if (judged_ == step_ || now < judging_) return verdict_;
  verdict_ = monitor_->verdict(parted);
  judged_ = step_;
  judging_ = after(now);
  return verdict_;
}

}  // namespace sim::cli
