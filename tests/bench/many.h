// Scenes of many bodies and rods: what a step costs, what a second thread brings, and how exactly
// their constraints are obeyed.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"

namespace sim_bench {

struct ManyResult {
  std::string scene;
  int count = 0;          // of bodies, or of rods
  double h = 0;           // s
  double seconds = 0;     // of a step on one thread, the mean
  double faster = 0;      // times, on two threads, in turns
  double constraint = 0;  // m, the largest equation in absolute value at the end
  bool same = false;      // bits on both numbers of threads
};

// Measures the cases whose names hold `options.only`.
std::vector<ManyResult> measure_many(const Options& options, sim::Registry& registry);
Table many_table(const std::vector<ManyResult>& results);

}  // namespace sim_bench
