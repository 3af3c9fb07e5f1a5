// Implicit steps of an elastic beam: the kernel against a sparse factorisation of its matrix.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"
#include "tests/bench/timing.h"

namespace sim_bench {

struct SolidStepResult {
  int nodes = 0, order = 1;
  double poisson = 0.3;
  Times newton, peer;                  // of a Newton step; of a factorisation and a solution
  double newtons = 0, iterations = 0;  // a step of the scene, and of the linear solver in each
  bool finished = false;               // a step within the time that it has
};

// scenes/beam.lua in steps of 0.01 s from rest, with about 1000, 9000 and (not with --quick) 100000
// nodes; the peer factorises and solves M / h^2 + K there, its symbolic part made once.
std::vector<SolidStepResult> measure_solid_steps(const Options& options, sim::Registry& registry);
Table solid_step_table(const std::vector<SolidStepResult>& results);

}  // namespace sim_bench
