#include "tests/bench/memory.h"

#include <malloc.h>

#include <cstdio>
#include <fstream>

#include "core/base/text.h"
#include "tests/bench/child.h"
#include "tests/bench/cloth.h"

namespace sim_bench {
namespace {

// A field of /proc/self/status in bytes; 0 when there is none.
double status_bytes(const std::string& field) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(field + ":")) return std::stod(line.substr(field.size() + 1)) * 1024;
  return 0;
}

// The highest point so far becomes the present one.
void reset_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

void build_and_step(const sim::SystemSpec& spec, sim::Registry& registry,
                    const sim::RunOptions& options, MemoryUse* use) {
  const double before = status_bytes("VmRSS");
  reset_peak();
  sim::Simulation simulation(spec, registry, options);
  for (int i = 0; i < 4; ++i) simulation.steps(4);
  *use = {status_bytes("VmRSS") - before, status_bytes("VmHWM") - before};
}

}  // namespace

int print_memory(int n, const std::string& integrator) {
  sim::Registry registry = make_registry();
  const sim::MethodChoice choice = sim::cli::parse_integrator(integrator);
  MemoryUse use;
  // A small one first: code and libraries are in memory before anything is measured.
  build_and_step(load_cloth(8, registry), registry, run_options(choice, 8, registry), &use);
  const sim::SystemSpec spec = load_cloth(n, registry);
  malloc_trim(0);
  build_and_step(spec, registry, run_options(choice, n, registry), &use);
  std::printf("%.0f %.0f\n", use.resident, use.peak);
  return 0;
}

MemoryUse measure_memory(int n, const std::string& integrator) {
  Child child({"/proc/self/exe", "--memory-of", std::to_string(n), integrator});
  const std::string line = child.read_line().value_or("");
  const auto space = line.find(' ');
  if (child.wait() != 0 || space == std::string::npos) return {};
  return {sim::parse_number(line.substr(0, space)).value_or(0),
          sim::parse_number(line.substr(space + 1)).value_or(0)};
}

}  // namespace sim_bench
