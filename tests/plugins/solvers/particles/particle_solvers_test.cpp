// The plugin of the solvers of implicit methods: when it is opened, and what is said without it.
#include <algorithm>
#include <catch2/catch.hpp>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/particles/particle_system.h"
#include "tests/support/scenes.h"

using namespace sim;

TEST_CASE("solvers of implicit methods are opened when a method first asks", "[particles]") {
  Registry registry = sim_test::make_registry();
  const auto is_open = [&] {
    return std::ranges::count(registry.inputs(), "solver 'particles'", &InputFile::name) == 1;
  };
  SystemSpec cloth = sim_test::make_cloth(4);
  for (const char* const method : {"rk4", "verlet", "dopri5"}) {
    cloth.integrator = method;
    Simulation simulation(cloth, registry);
    CHECK(simulation.step());
    CHECK_FALSE(is_open());
  }
  // A checkpoint of an implicit run names the library that its numbers come from.
  cloth.integrator = "implicit_euler";
  Simulation simulation(cloth, registry);
  CHECK(simulation.step());
  CHECK(is_open());
}

TEST_CASE("particles without solvers refuse implicit methods alone", "[particles]") {
  const Layout layout(1);
  Array x(layout.size());
  ThreadPool pool(1);
  ParticleSystem system({1.0}, {}, {}, x.data(), pool);
  CHECK(system.split_stepper({.drift = {0, 1, 0}, .kick = {0.5, 0.5}, .order = 2}));
  CHECK_THROWS_WITH(system.stage_solver({}),
                    Catch::Contains("nothing that solves its equations; open the plugin "
                                    "solvers/particles, or use rk4"));
  CHECK_THROWS_AS(system.implicit_explicit_stepper({}), Error);
}
