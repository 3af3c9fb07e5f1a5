// esdirk43 on the stiff problems that everyone knows, and on stiff springs.
#include <catch2/catch.hpp>
#include <cmath>

#include "plugins/integrators/stiff/adaptive_implicit.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::test::load_text;

namespace {

sim::SystemSpec robertson() {
  return load_text(R"(return sim.scene { state = {1, 0, 0}, field = sim.field.lua { function(t, y)
      local slow, fast, pair = 0.04 * y[1], 1e4 * y[2] * y[3], 3e7 * y[2] * y[2]
      return { fast - slow, slow - fast - pair, pair } end },
      integrator = "esdirk43", dt = 40, duration = 40 })")
      .systems[0];
}

sim::SystemSpec van_der_pol() {
  return load_text(R"(return sim.scene { state = {2, 0}, field = sim.field.lua { function(t, y)
      return { y[2], 1000 * (1 - y[1] * y[1]) * y[2] - y[1] } end },
      integrator = "esdirk43", dt = 2000, duration = 2000 })")
      .systems[0];
}

struct Solved {
  std::vector<double> state;
  std::int64_t steps = 0;
};

Solved solve(const sim::SystemSpec& spec, const std::string& integrator, double tol, double dt,
             int count, sim::Registry& registry) {
  sim::RunOptions options{.integrator = integrator, .dt = dt};
  options.integrator.given["tol"] = tol;
  sim::Simulation simulation(spec, registry, options);
  REQUIRE(run(simulation, count));
  return {state_of(simulation), simulation.integrator().effort().steps};
}

}  // namespace

// At t = 40: Robertson (1966); the digits of 25-digit computations, as in Hairer & Wanner, Solving
// ODEs II (1996), section IV.10, and the test set for IVP solvers of Mazzia & Magherini (2008).
TEST_CASE("Robertson's kinetics: the error follows the tolerance over six decades") {
  sim::Registry registry = make_registry();
  const double exact[] = {0.7158270687193941, 9.185534764557338e-6, 0.2841637457458412};
  for (const double tol : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
    const Solved found = solve(robertson(), "esdirk43", tol, 40, 1, registry);
    INFO("tol " << tol);
    for (int i = 0; i < 3; ++i) CHECK(std::fabs(found.state[i] - exact[i]) <= 10 * tol);
    CHECK(found.steps < 400);
  }
  const Solved chosen = solve(robertson(), "auto", 1e-3, 0.5, 80, registry);
  for (int i = 0; i < 3; ++i) CHECK(std::fabs(chosen.state[i] - exact[i]) <= 1e-3);
}

// At t = 2000, as there.
TEST_CASE("van der Pol's oscillator with mu = 1000: the error follows the tolerance") {
  sim::Registry registry = make_registry();
  const double exact[] = {1.706167732170483, -0.8928097010247975e-3};
  for (const double tol : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
    const Solved found = solve(van_der_pol(), "esdirk43", tol, 2000, 1, registry);
    INFO("tol " << tol);
    CHECK(std::fabs(found.state[0] - exact[0]) <= 50 * tol);
    CHECK(std::fabs(found.state[1] - exact[1]) <= tol);
    CHECK(found.steps < 10000);
  }
  // dopri5 takes more than a million.
  CHECK(solve(van_der_pol(), "esdirk43", 1e-6, 2000, 1, registry).steps < 2000);
}

// x'' = -x in steps of a fixed size H, looked at every 0.07 s: at other places in each step.
TEST_CASE("states inside a step of esdirk43 are of order 4, and cost no steps") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec circle =
      load_text(R"(return sim.scene { state = {1, 0}, field = sim.field.lua { function(t, y)
      return { y[2], -y[1] } end }, integrator = "esdirk43", dt = 0.07, duration = 7 })")
          .systems[0];
  const auto worst = [&](double largest) {
    sim::RunOptions options{.integrator = "esdirk43", .dt = 0.07};
    options.integrator.given["tol"] = 1e-6;
    options.integrator.given["max_step"] = largest;
    sim::Simulation simulation(circle, registry, options);
    double most = 0;
    for (int i = 1; i <= 100; ++i) {
      REQUIRE(simulation.step());
      most = std::max(most, std::fabs(state_of(simulation)[0] - std::cos(simulation.t())));
    }
    const auto steps = simulation.integrator().effort().steps;
    CHECK(steps >= 7 / largest);
    CHECK(steps <= 7 / largest + 15);  // the first are small
    return most;
  };
  const double coarse = worst(0.1), middle = worst(0.05), fine = worst(0.025);
  INFO(coarse << " " << middle << " " << fine);
  CHECK(std::log2(coarse / middle) == Approx(4).margin(0.3));
  CHECK(std::log2(middle / fine) == Approx(4).margin(0.3));

  // The same steps, however often they are looked at.
  const Solved often = solve(van_der_pol(), "esdirk43", 1e-6, 1, 2000, registry);
  const Solved once = solve(van_der_pol(), "esdirk43", 1e-6, 2000, 1, registry);
  CHECK(often.steps == once.steps);
  CHECK(often.state == once.state);
}

TEST_CASE("esdirk43 goes on bit for bit from its memory, and stiff springs follow the tolerance") {
  sim::Registry registry = make_registry();
  sim::SystemSpec cloth = make_cloth(4);
  for (sim::PartSpec& force : cloth.forces)
    if (force.plugin == "spring") force.given["stiffness"] = 1e4;
  const auto options = [](double tol) {
    sim::RunOptions run_options{.integrator = "esdirk43", .dt = 0.02};
    run_options.integrator.given["tol"] = tol;
    return run_options;
  };
  const auto after = [&](double tol) {
    sim::Simulation simulation(cloth, registry, options(tol));
    REQUIRE(run(simulation, 4));
    return state_of(simulation);
  };
  const std::vector<double> exact = after(1e-9);
  for (const double tol : {1e-4, 1e-6}) {
    const std::vector<double> found = after(tol);
    for (std::size_t i = 0; i < exact.size(); ++i)
      REQUIRE(std::fabs(found[i] - exact[i]) <= 100 * tol);
  }

  sim::Simulation whole(cloth, registry, options(1e-6)), parted(cloth, registry, options(1e-6));
  REQUIRE(run(whole, 2));
  const sim::Snapshot middle = whole.snapshot();
  REQUIRE(run(whole, 2));
  parted.restore(middle);
  REQUIRE(run(parted, 2));
  CHECK(parted.hash() == whole.hash());
}
