// Other programs on the same scene: built when wanted, checked against ours, timed in turns with
// it.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/contact_peers.h"
#include "tests/bench/fluid_peers.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"
#include "tests/bench/timing.h"

namespace sim_bench {

struct PeerResult {
  int n = 0;  // particles a side
  double particles = 0;
  std::string name, method;  // method: the integrator of ours it is compared with
  Times peer;
  std::vector<int> threads;  // of ours
  std::vector<Times> ours;   // one for each, none when ours lacks the method
  double difference = -1;    // rms distance of the positions over the rms way from the start
  double bound = 0;          // what the difference may be

  double million_steps(const Times& t) const { return 1e-6 * particles / t.median; }
  double ratio(std::size_t i) const { return peer.median / ours[i].median; }
};

struct PeerReport {
  std::vector<PeerResult> results;
  std::vector<ContactResult> contact;
  std::vector<FluidResult> fluid;
  std::vector<std::string> notes;  // versions, what is missing and how to get it
};

PeerReport measure_peers(const Options& options, sim::Registry& registry);
Table peer_table(const PeerReport& report);

// True when every peer that was compared lies within its bound.
bool all_agree(const PeerReport& report);

}  // namespace sim_bench
