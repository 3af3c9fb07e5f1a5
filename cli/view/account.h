// The account of a live scene: the energy of one system over time, and a verdict.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/output/view.h"
#include "core/session/player.h"
#include "core/study/verdict/verdict.h"

namespace sim::cli {

// E + W - E(0) while users act and time goes back and forth. The past is stored as samples, fewer
// of the older ones.
class EnergyAccount {
 public:
  // All of them outlive it.
  EnergyAccount(Player& player, std::size_t system, const SystemSpec& spec, Registry& registry);

  // Steps until the next sample of the state, at least 1.
  std::int64_t due() const;
  void look();       // before hands do something
  void stepped();    // after steps, hands and all that is done between them
  void travelled();  // after a jump in time, and when another step or method begins
  EnergySample sample();
  // The step of the last sample before the energy rose a million times, if it did; else -1.
  std::int64_t last_good() const;

  // The verdict of a run that ends here, from what was checked since the last travelled(): now and
  // then, as it costs. `parted`: how wrong the positions are, if that is known.
  const study::Verdict& verdict(const study::RunDeviation& parted);

  const std::vector<EnergySample>& samples() const { return samples_; }

 private:
  using Clock = std::chrono::steady_clock;
  void begin(double drift);
  void check(const Energy& energy);

  Player* player_;
  std::size_t index_;
  const SystemSpec* spec_;
  Registry* registry_;
  std::unique_ptr<study::Monitor> monitor_;
  study::Verdict verdict_;
  std::int64_t judged_ = -1;             // the step of the last verdict
  Clock::time_point checked_, judging_;  // not before, again
  double start_ = 0, base_ = 0;          // J
  std::int64_t step_ = 0, touches_ = 0;
  std::vector<EnergySample> samples_;  // by step
};

// "dt is 61 % of the largest stable step", and the share; not a number if it is not known.
double stable_share(Simulation& system);

}  // namespace sim::cli
