// The options of `sim_bench`.
#pragma once

#include <string>
#include <vector>

#include "cli/command_line/integrator_choice.h"
#include "tests/bench/timing.h"

namespace sim_bench {

enum class Format { kText, kMarkdown, kJson };

struct Options {
  Format format = Format::kText;
  bool peers = false, help = false;
  bool only_implicit = false, only_contact = false, only_fluid = false, only_fields = false,
       only_bodies = false, only_solids = false, only_ways = false;
  bool quick = false;
  std::string only;    // of the problems of first order, and of bodies, those whose names hold it
  std::string charts;  // a folder for theirs; empty = beside the peers
  std::string simd;    // the instruction set of kernel and peers; empty = the best one here
  std::vector<int> sizes = {8, 32, 128, 512, 1024};  // particles a side
  std::vector<int> threads = {1, 2};
  std::vector<sim::MethodChoice> integrators;  // empty = the usual ones
  TimingOptions timing;

  std::string memory_of;  // an integrator: only print the memory of sizes[0] with it
};

extern const char* const kUsage;

// Throws sim::Error{kUsage} for anything it does not know.
Options parse_options(int argc, char** argv);

}  // namespace sim_bench
