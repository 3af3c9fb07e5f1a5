// The kernel measured on the cloth and on variations of its springs.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "core/scene/simulation.h"
#include "tests/bench/machine.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"
#include "tests/bench/timing.h"

namespace sim_bench {

// A simulation as a contestant; a run that leaves the finite numbers throws sim::Error{kDiverged}.
Contestant contestant(sim::Simulation& simulation);

// The cloth with a sphere below (or, with a gap < 0, above) its middle.
sim::SystemSpec with_sphere(sim::SystemSpec cloth, double gap, double friction);

struct KernelResult {
  int n = 0;               // particles a side
  std::string integrator;  // as `sim -i` takes it
  int threads = 1, evaluations = 0;
  bool in_double = true;
  long springs = 0;
  Times times;
  double allocations = 0;            // a step
  double bytes = 0, peak_bytes = 0;  // a particle beyond the scene; 0 = not measured

  double particles() const { return static_cast<double>(n) * n; }
  double spring_ns() const {
    return times.median * 1e9 / static_cast<double>(springs) / evaluations;
  }
  double million_steps() const { return particles() / times.median * 1e-6; }
};

// The methods asked for, or the usual ones that the registry has.
std::vector<sim::MethodChoice> choose_integrators(const Options& options, sim::Registry& registry);

std::vector<KernelResult> measure_kernel(const Options& options, sim::Registry& registry);
Table kernel_table(const std::vector<KernelResult>& results, const Machine& machine);

// The 128 x 128 cloth under rk4 on one thread with its springs given in other ways.
struct Variation {
  std::string name, meaning;
  Times times;
  double spring_ns = 0;
};
std::vector<Variation> measure_variations(const Options& options, sim::Registry& registry);
Table variation_table(const std::vector<Variation>& variations);

}  // namespace sim_bench
