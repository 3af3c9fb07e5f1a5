// Forces that a scene writes as Lua functions.
#include <cmath>

#include "core/scene/simulation.h"
#include "core/study/verdict/bad_force.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

std::string scene(const std::string& force, const std::string& integrator = "rk4") {
  return "local particles = sim.particles { mass = 2 }\n"
         "particles:add({1, 0, 0})\n"
         "particles:add({0.5, 0.1, -0.2}, { velocity = {1, 0, 0.5} })\n"
         "particles:add({-0.3, 0.7, 0.9}, { velocity = {0, -1, 0.2} })\n"
         "particles:pin(0)\n"
         "return sim.scene { particles = particles, forces = { " +
         force + " }, integrator = '" + integrator + "', dt = 0.01, duration = 1 }\n";
}

Simulation compiled(const std::string& text) {
  Registry registry({SIM_PLUGIN_DIR});
  return Simulation(load_text(text).systems[0], registry);
}

void check_same(const std::string& one, const std::string& other) {
  Simulation a = compiled(one), b = compiled(other);
  REQUIRE((sim_test::run(a, 50) && sim_test::run(b, 50)));
  const std::vector<double> at_a = sim_test::state_of(a), at_b = sim_test::state_of(b);
  for (std::size_t i = 0; i < at_a.size(); ++i)
    CHECK(at_a[i] == Approx(at_b[i]).epsilon(1e-12).margin(1e-12));
  CHECK(a.energy().potential == Approx(b.energy().potential).epsilon(1e-12).margin(1e-12));
}

std::optional<Error> step_error(const std::string& force) {
  Simulation simulation = compiled("\n" + scene(force));
  try {
    simulation.step();
  } catch (const Error& error) {
    return error;
  }
  return {};
}

}  // namespace

TEST_CASE("a force written in Lua acts as the force it describes", "[lua][force]") {
  check_same(scene("sim.force.lua { function(t, i, x, v) return 0, -2 * 9.81, 0 end, "
                   "potential = function(t, i, x) return 2 * 9.81 * x[2] end }"),
             scene("sim.force.gravity {}"));
  check_same(scene("sim.force.lua { function(t, i, x, v) return -v[1], -v[2], -v[3] end }"),
             scene("sim.force.drag { k = 1 }"));
  // With time and id, without velocities.
  const char* const times = "(1 + t)";
  check_same(
      scene("sim.force.lua { function(t, i, x, v) assert(v == nil and i >= 0 and i < 3) return " +
                std::string(times) + " * x[2], 0, 0 end, reads_velocity = false }",
            "verlet"),
      scene("sim.force.expression { fx = '(1 + t)*y' }", "verlet"));
  check_same(scene("sim.force.lua { function(t, i, x, v) return -50 * x[1], 0, 0 end }", "trbdf2"),
             scene("sim.force.expression { fx = '-50*x' }", "trbdf2"));
}

TEST_CASE("splitting methods of fourth order refuse a force in Lua that may read velocities",
          "[lua][force]") {
  CHECK_THROWS_AS(
      compiled(scene("sim.force.lua { function(t, i, x, v) return 0, 0, 0 end }", "pefrl")), Error);
}

TEST_CASE("a bad result of a force in Lua names its line and the particle", "[lua][force]") {
  const std::pair<const char*, const char*> cases[] = {
      {"return 1, 2", "expected 3 numbers, got 1, 2"},
      {"return 1, 2, 3, 4", "got 1, 2, 3, 4"},
      {"return {1, 2, 3}", "got a table"},
      {"return 1, '2', 3", "got 1, '2', 3"},
      {"return", "got nothing"},
      {"return x.y.z, 0, 0", "field 'y'"},
      {"error('stop')", "stop"},
      {"error({})", "error object"},
      {"return table.unpack({}, 1, 200)", "..."},
      {"local function f() return 1 + f() end return f()", "stack overflow"},
  };
  for (const auto& [body, says] : cases) {
    const auto error = step_error("sim.force.lua { function(t, i, x, v) if i == 1 then " +
                                  std::string(body) + " end return 0, 0, 0 end }");
    INFO(body);
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(error->text().where.ends_with("scene.lua:8"));
    CHECK(contains(error->what(), says));
    CHECK(contains(error->what(), "particle 1"));
  }
}

TEST_CASE("a force in Lua that is not a number stops the run", "[lua][force]") {
  Simulation simulation = compiled(
      scene("sim.force.lua { function(t, i, x, v) return 0, i == 2 and 0/0 or 0, 0 end }"));
  CHECK_FALSE(simulation.step());
  CHECK(simulation.divergence().particle == 2);
}

TEST_CASE("the force that was not a number is named, not where that spread to", "[lua][force]") {
  Registry registry({SIM_PLUGIN_DIR});
  const auto blamed = [&](const std::string& forces) {
    const SystemSpec spec = load_text(scene(forces)).systems[0];
    Simulation simulation(spec, registry);
    int steps = 0;
    while (simulation.step() && ++steps < 1000) {}
    REQUIRE(steps < 1000);
    return study::find_bad_force(spec, simulation);
  };
  // Within the 31st step, on particle 2, which pulls at the others by springs.
  const auto found = blamed(
      "sim.force.spring { stiffness = 10, rest = 1, ties = { {0, 1}, {1, 2} } }, "
      "sim.force.lua { function(t, i, x, v) return 0, 0, 0 end },\n"
      "sim.force.lua { function(t, i, x, v) return i == 2 and t > 0.302 and 0/0 or 0, 0, 0 end }");
  REQUIRE(found);
  CHECK(found->name == "lua");
  CHECK(found->place.ends_with("scene.lua:8"));
  CHECK(found->particle == 2);
  // Overflow is the fault of the step, not of a force.
  CHECK_FALSE(
      blamed("sim.force.spring { stiffness = 1e9, rest = 1, ties = { {0, 1}, {1, 2} } }, "
             "sim.force.expression { 'x^2' }"));
}

TEST_CASE("a method that cannot take a force says which, at its line", "[lua][force]") {
  for (const auto& [method, force] :
       {std::pair{"pefrl", "sim.force.expression { fx = '-vx*abs(vx)' }"},
        {"projective_dynamics", "sim.force.expression { 'x^2' }"}}) {
    try {
      compiled(scene("sim.force.gravity {},\n" + std::string(force), method));
      FAIL();
    } catch (const Error& error) {
      INFO(error.what());
      CHECK(error.text().where.ends_with("scene.lua:8"));
      CHECK(contains(error.text().why, "'expression'"));
    }
  }
}

TEST_CASE("a force in Lua outlives an error", "[lua][force]") {
  Simulation simulation = compiled(
      scene("sim.force.lua { function(t, i, x, v) if t == 0 then error('first') end return 0, 0, 0 "
            "end }"));
  for (int i = 0; i < 300; ++i) CHECK_THROWS_AS(simulation.step(), Error);
}
