// Contact against another program: a cloth on a sphere, one in folds, and a stack of boxes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/peer_build.h"
#include "tests/bench/table.h"

namespace sim_bench {

// One program on one scene. The methods differ, and so do the steps that each can take: what is
// compared is time, and how far each is from what the scene says.
struct ContactResult {
  std::string scene, program;
  int count = 0;                // particles, or boxes
  double h = 0, seconds = 0;    // s: a step, and the time it took
  int inside = 0;               // particles in the sphere when it has fallen
  double deepest = 0;           // m, of these
  double longest = 0;           // 1, the largest strain of a spring then
  std::int64_t crossings = -1;  // of the cloth with itself then; -1: not looked for
  double creep = 0;             // m, of a box in ten seconds
};

// The peers are those called bullet..; nothing without them.
std::vector<ContactResult> measure_contact(const std::vector<PeerKind>& peers,
                                           const Options& options, sim::Registry& registry);
Table contact_table(const std::vector<ContactResult>& results);

}  // namespace sim_bench
