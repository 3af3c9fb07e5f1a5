// Memory of a simulation, measured in a fresh process of its own.
#pragma once

#include <string>

namespace sim_bench {

// Bytes beyond the scene as plain data: what compiling it and four steps add to the pages in
// memory.
struct MemoryUse {
  double resident = 0;  // after the steps
  double peak = 0;      // at the highest point, with what compiling needs for a while
};

// Starts this program again as `sim_bench --memory-of N INTEGRATOR` and reads what it prints.
// Both are 0 when that fails or the system does not tell.
MemoryUse measure_memory(int n, const std::string& integrator);

// The other side: measures here and prints; returns the exit code.
int print_memory(int n, const std::string& integrator);

}  // namespace sim_bench
