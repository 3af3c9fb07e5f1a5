// The measured limits of the machine itself, with which the kernel is compared.
#pragma once

#include <string>
#include <vector>

namespace sim_bench {

struct Bandwidth {
  std::string level;  // "L1", "L2", "L3", "memory"
  double kib = 0;     // size of the three arrays together
  double gb_per_s = 0;
};

struct Machine {
  std::string processor;  // the name the system gives
  int cores = 0;
  double load = 0;               // processes that ran or waited to, over the last minute
  std::string vector;            // widest instruction set: as core/simd/simd_targets.h names it
  int lanes = 0;                 // doubles in a vector
  double ghz = 0;                // from a chain of integer multiplications, 3 cycles each
  double flops_per_ns = 0;       // multiplications and additions in doubles, half and half
  double double_root_ns = 0;     // one square root and one division in double precision
  double single_root_ns = 0;     // the same in single precision, `lanes` at a time
  std::vector<Bandwidth> triad;  // a[i] = b[i] + s c[i], 24 bytes an element

  // The least time for one spring on one core: 35 operations on doubles at the rate above, or the
  // seed of the inverse square root, whichever takes longer.
  double spring_limit_ns() const;
};

// Takes about a second on one core.
Machine measure_machine();

}  // namespace sim_bench
