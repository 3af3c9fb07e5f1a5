// Piles of boxes against another program.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/peer_build.h"
#include "tests/bench/table.h"

namespace sim_bench {

// One program on scenes/pile.lua with steps of the same length.
struct PileResult {
  std::string program;
  int boxes = 0;
  double seconds = 0;      // of a step, the mean while the pile falls together
  double ratio = 0;        // of these over those of the peer, in turns; 0: the peer itself
  double penetration = 0;  // m, at least, at the end of that
  double creep = 0;        // m, the farthest that a box moves in a second after it
};

// The peer is the one called bullet; nothing without it. Piles whose names, such as "pile, 27",
// hold `options.only`.
std::vector<PileResult> measure_piles(const std::vector<PeerKind>& peers, const Options& options,
                                      sim::Registry& registry);
Table pile_table(const std::vector<PileResult>& results);

}  // namespace sim_bench
