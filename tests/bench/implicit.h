// One backward Euler step of a stiff cloth: the kernel against Eigen's sparse solvers.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"
#include "tests/bench/timing.h"

namespace sim_bench {

struct ImplicitResult {
  int n = 0;  // particles a side
  std::string solver;
  Times times;            // a step
  double iterations = 0;  // of an iterative solver, a step
};

// h = 0.01 s, k = 1e5 N/m (structural; shear 1/2, flex 1/4 of it), 1 kg a particle, no drag; one
// linearised step, its equations to a relative residual of 1e-6. All in turns.
std::vector<ImplicitResult> measure_implicit(const Options& options, sim::Registry& registry);
Table implicit_table(const std::vector<ImplicitResult>& results);

}  // namespace sim_bench
