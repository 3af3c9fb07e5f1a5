// Implicit steps of a stiff cloth: the kernel against sparse factorisations and against verlet.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"
#include "tests/bench/timing.h"

namespace sim_bench {

struct ImplicitResult {
  int n = 0;     // particles a side
  double k = 0;  // N/m
  std::string what;
  Times times;                        // of 0.01 s of the scene
  double newton = 0, iterations = 0;  // in that time
  double residual = -1;               // of linear equations, relative; -1: not known
  double bytes = 0;                   // a particle beyond the scene; 0: not measured
};

// scenes/cloth.lua (1 kg in all) without drag, stiffness k, k/2 and k/4, from rest, in steps of
// 0.01 s; each contestant takes the first four again and again. All in turns.
std::vector<ImplicitResult> measure_implicit(const Options& options, sim::Registry& registry);
Table implicit_table(const std::vector<ImplicitResult>& results);

}  // namespace sim_bench
