// A dam that breaks, against another program of smoothed particles.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"

namespace sim_bench {

// One program on scenes/dam.lua, in the plane or in space.
struct FluidResult {
  int dimensions = 2;
  std::string program;
  int water = 0, walls = 0;   // particles
  double h = 0, seconds = 0;  // s: a step, and the time it took
  double front = 0;           // of the water at a moment, in widths of the column
};

// The peer is PySPH of Debian's python3; nothing and a note without it.
std::vector<FluidResult> measure_fluid(const Options& options, sim::Registry& registry,
                                       std::vector<std::string>& notes);
Table fluid_table(const std::vector<FluidResult>& results);

}  // namespace sim_bench
