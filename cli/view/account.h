// What a live scene has to say of itself in numbers: the energy of one system along the way.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/player.h"
#include "core/study/energy_balance.h"

namespace sim::cli {

struct EnergySample {
  std::int64_t step = 0;
  double t = 0;                                  // s
  double kinetic = 0, potential = 0, drift = 0;  // J
};

// E + W - E(0) while hands act and time goes back and forth. The past is kept as samples, fewer of
// the older ones.
class EnergyAccount {
 public:
  EnergyAccount(Player& player, std::size_t system);

  // Steps until it wants to see the state, at least 1.
  std::int64_t due() const;
  void look();       // before hands do something
  void stepped();    // after steps, hands and all that is done between them
  void travelled();  // after a way through time
  EnergySample sample();
  // The step of the last sample before the energy rose a million times, if it did; else -1.
  std::int64_t last_good() const;

  const std::vector<EnergySample>& samples() const { return samples_; }

 private:
  void begin(double drift);
  double drift();

  Player* player_;
  std::size_t index_;
  std::optional<study::EnergyBalance> balance_;  // of a second-order system
  double start_ = 0, base_ = 0;                  // J
  std::int64_t step_ = 0, touches_ = 0;
  std::vector<EnergySample> samples_;  // by step
};

// "dt is 61 % of the largest stable step", and the share; not a number where it is not known.
double stable_share(Simulation& system);

// What is to be said of the system as it is: a trust and why.
std::string live_verdict(const EnergySample& now, const std::vector<EnergySample>& past,
                         double share, const Simulation& system);

}  // namespace sim::cli
