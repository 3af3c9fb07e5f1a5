// The bits of whole runs, on every instruction set. Who changes them says so in CHANGELOG.md.
#include <catch2/catch.hpp>
#include <cstdlib>

#include "core/simd/simd_targets.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

struct Golden {
  const char* method;
  int n;      // particles a side of the cloth
  double dt;  // s
  int steps;
  std::uint64_t hash;
  const char* precision = "double";
};

const Golden kGolden[] = {{"rk4", 8, 0.005, 400, 0x129f25ebe3e79c14},
                          {"euler", 9, 1e-5, 300, 0x943f8a6b1e5ff166},
                          {"trapezoid", 12, 1e-4, 300, 0x09cbdf5d37e49b05},
                          {"symplectic_euler", 17, 0.001, 300, 0x5728dce375a017de},
                          {"verlet", 20, 0.001, 300, 0xc0f92f1e3c57095d},
                          {"rk4", 96, 1e-4, 20, 0x2bece6f02611b4d7},
                          {"implicit_euler", 20, 0.01, 40, 0x2fabdbbaad36c4af},
                          {"implicit_midpoint", 9, 0.01, 40, 0x558173b949c2b5ad},
                          {"trbdf2", 17, 0.01, 20, 0x2035172623ff729a},
                          {"bdf2", 2, 0.01, 40, 0x310d393043cd8283},
                          {"projective_dynamics", 8, 0.01, 20, 0xdbbd2507ab72860e},
                          {"implicit_euler", 72, 0.002, 5, 0x078f7b4756b40687},
                          {"implicit_euler", 40, 0.5, 2, 0x1364994fedeb69bd},  // many iterations
                          {"rk4", 9, 0.005, 300, 0x3932bb216aeb58e2, "single"},
                          {"verlet", 20, 0.001, 300, 0xcb3d795496408d45, "single"},
                          {"pefrl", 37, 0.001, 100, 0xebe51c895e5a34f1, "single"},
                          {"rk4", 96, 1e-4, 20, 0x8277bd95d49eee10, "single"}};

std::uint64_t hash_of(const Golden& golden, int threads) {
  sim::Registry registry = make_registry();
  sim::RunOptions options{.integrator = golden.method, .dt = golden.dt, .threads = threads};
  if (golden.precision != std::string("double"))
    options.integrator.given["precision"] = std::string(golden.precision);
  sim::Simulation simulation(make_cloth(golden.n), registry, options);
  REQUIRE(run(simulation, golden.steps));
  return simulation.hash();
}

}  // namespace

TEST_CASE("runs have the same bits on every instruction set, as ever") {
  for (const Golden& golden : kGolden) {
    for (const char* level : {"sse2", "fma", "avx2", "avx512"}) {
      INFO(golden.method << " on " << golden.n << " x " << golden.n << ", " << level);
      setenv("SIM_SIMD", level, 1);
      CHECK(hash_of(golden, 1) == golden.hash);
      CHECK(hash_of(golden, 2) == golden.hash);
    }
    unsetenv("SIM_SIMD");
  }
}
