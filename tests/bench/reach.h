// The figures that the kernel has to reach, beside those it has.
#pragma once

#include <vector>

#include "tests/bench/kernel.h"
#include "tests/bench/peers.h"
#include "tests/bench/table.h"

namespace sim_bench {

// Rows for whatever was measured; `peers` may be empty.
Table reach_table(const std::vector<KernelResult>& kernel, const std::vector<Variation>& variations,
                  const PeerReport& peers);

}  // namespace sim_bench
