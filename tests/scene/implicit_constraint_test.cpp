// Implicit methods on many constraints, whose equations are solved by products alone.
#include <cmath>

#include "core/ode/implicit/dense_solver.h"
#include "core/ode/implicit/krylov_solver.h"
#include "core/particles/constraints/constraint_system.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

sim::SystemSpec rope(int links) {
  return load("scenes/rope.lua", {{"n", std::to_string(links)}}).systems[0];
}

}  // namespace

TEST_CASE("GMRES solves the stages that a dense matrix solves") {
  Registry registry({SIM_PLUGIN_DIR});
  Simulation system(rope(30), registry, {.integrator = {"rk4"}, .dt = 0.002});
  for (int n = 0; n < 100; ++n) REQUIRE(system.step());
  const std::vector<double> x(system.state().begin(), system.state().end());
  DenseSolver dense(system.ode(), {});
  KrylovSolver krylov(system.ode(), {});
  for (const double tau : {1e-4, 1e-3, 1e-2}) {
    INFO(tau);
    std::vector<double> a = x, b = x;
    REQUIRE(dense.solve(0.2, tau, x.data(), a.data()) == StepStatus::kDone);
    REQUIRE(krylov.solve(0.2, tau, x.data(), b.data()) == StepStatus::kDone);
    double moved = 0, apart = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      moved = std::max(moved, std::fabs(a[i] - x[i]));
      apart = std::max(apart, std::fabs(a[i] - b[i]));
    }
    CHECK(moved > 0.1 * tau);
    CHECK(apart < 1e-9 * moved);
  }
}

TEST_CASE("a rope of 1000 links under implicit_midpoint") {
  Registry registry({SIM_PLUGIN_DIR});
  Simulation system(rope(1000), registry, {.integrator = {"implicit_midpoint"}, .dt = 0.0005});
  Simulation fine(rope(1000), registry, {.integrator = {"rk4"}, .dt = 0.0005});
  const double energy = system.energy().total();
  for (int n = 0; n < 60; ++n) {
    REQUIRE(system.step());
    REQUIRE(fine.step());
    const ConstraintDrift drift =
        system.constraint_system()->drift(system.t(), system.state().data());
    CHECK(drift.position < 1e-13);
  }
  CHECK(std::fabs(system.energy().total() - energy) < 1e-5 * system.energy().kinetic);
  double apart = 0;
  for (int i = 0; i <= 1000; ++i)
    apart = std::max(apart, (system.position(i) - fine.position(i)).norm());
  CHECK(apart < 1e-5);
}

TEST_CASE("implicit methods keep their order on many rods") {
  Registry registry({SIM_PLUGIN_DIR});
  Simulation reference(rope(120), registry, {.integrator = {"rk4"}, .dt = 0.0005});
  while (reference.t() < 0.1 - 1e-9) REQUIRE(reference.step());
  double error[2];
  for (int k = 0; k < 2; ++k) {
    Simulation system(rope(120), registry,
                      {.integrator = {"implicit_midpoint"}, .dt = k == 0 ? 0.004 : 0.002});
    while (system.t() < 0.1 - 1e-9) REQUIRE(system.step());
    error[k] = 0;
    for (int i = 0; i <= 120; ++i)
      error[k] = std::max(error[k], (system.position(i) - reference.position(i)).norm());
  }
  CHECK(std::log2(error[0] / error[1]) == Approx(2).margin(0.2));
}
