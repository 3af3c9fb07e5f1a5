// The same scene in more than one way: soft or with stiff parts, awake or asleep, by a built-in law
// or a formula, on one thread or two.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"
#include "tests/bench/timing.h"

namespace sim_bench {

struct VariantResult {
  std::string scene, way;
  int particles = 0;
  double h = 0;      // s
  Times times;       // of a step
  double ratio = 0;  // time for a second of the scene, over that of the first way
};

// Measures the scenes whose names hold `options.only`, the ways of each in turns.
std::vector<VariantResult> measure_ways(const Options& options, sim::Registry& registry);
Table way_table(const std::vector<VariantResult>& results);

}  // namespace sim_bench
