// The bits of whole runs, on every instruction set. Who changes them says so in CHANGELOG.md.
#include <catch2/catch.hpp>
#include <cstdlib>

#include "core/base/simd_targets.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

struct Golden {
  const char* method;
  int n;      // particles a side of the cloth
  double dt;  // s
  int steps;
  std::uint64_t hash;
};

const Golden kGolden[] = {{"rk4", 8, 0.005, 400, 0xb20455dd486bc5dc},
                          {"euler", 9, 1e-5, 300, 0xb245122bcbeb133a},
                          {"trapezoid", 12, 1e-4, 300, 0xaf5b1f4ef2708d1e},
                          {"symplectic_euler", 17, 0.001, 300, 0x8a38b726bc51897a},
                          {"verlet", 20, 0.001, 300, 0xca12351ce528ead0},
                          {"rk4", 96, 1e-4, 20, 0x46f52f84896650be},
                          {"implicit_euler", 20, 0.01, 40, 0x26e4f3adb73fdcc1},
                          {"implicit_midpoint", 9, 0.01, 40, 0x6241ecadd16e31e1},
                          {"trbdf2", 17, 0.01, 20, 0x53e993d6cd34170b},
                          {"bdf2", 2, 0.01, 40, 0xc68f1231a2c9643e},
                          {"projective_dynamics", 8, 0.01, 20, 0x8e92a8136b7ebdd6},
                          {"implicit_euler", 72, 0.002, 5, 0x1ea1e85aa18f287a}};

std::uint64_t hash_of(const Golden& golden, int threads) {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(make_cloth(golden.n), registry,
                             {.integrator = golden.method, .dt = golden.dt, .threads = threads});
  REQUIRE(run(simulation, golden.steps));
  return simulation.hash();
}

}  // namespace

TEST_CASE("runs have the same bits on every instruction set, as ever") {
  for (const Golden& golden : kGolden) {
    for (const char* level : {"sse2", "avx2", "avx512"}) {
      INFO(golden.method << " on " << golden.n << " x " << golden.n << ", " << level);
      setenv("SIM_SIMD", level, 1);
      CHECK(hash_of(golden, 1) == golden.hash);
      CHECK(hash_of(golden, 2) == golden.hash);
    }
    unsetenv("SIM_SIMD");
  }
}
