// Forces that are turned on and off while a scene runs.
#include <catch2/catch.hpp>

#include "core/session/checkpoint.h"
#include "core/session/timeline.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

// A cloth with springs, drag and wind; `pull` is on unless `options` say something else.
std::string cloth(const std::string& part, const std::string& options = "",
                  const std::string& switches = "switches = { pull = pull }, ") {
  return "local g = sim.grid { 6, 7, du = {0, 0, 0.2}, dv = {0.2, 0, 0}, mass = 0.02 }\n"
         "g:pin(0, 6)\n"
         "local skin = sim.surface { grid = g }\n"
         "local pull = " +
         part + options +
         " }\n"
         "return sim.scene { particles = g, " +
         switches +
         "forces = { sim.force.gravity {}, pull, sim.force.spring { stiffness = 30, grid = g, "
         "offsets = { {0, 1}, {1, 0}, {1, 1}, {1, -1} } } }, integrator = 'rk4', dt = 0.004, "
         "duration = 1 }";
}

const char* const kParts[] = {
    "sim.force.drag { k = 0.05",
    "sim.force.wind { velocity = {2, 0, 1}, breeze = 1, surface = skin",
    "sim.force.spring { stiffness = 20, damping = 0.1, grid = g, offsets = { {0, 2}, {2, 0} }",
    "sim.force.gust { c = 0.01"};

SystemSpec spec_of(const std::string& text) { return load_text(text).systems[0]; }

Simulation compiled(Registry& registry, const std::string& text,
                    const std::string& method = "rk4") {
  return Simulation(spec_of(text), registry, {.integrator = {method}});
}

}  // namespace

TEST_CASE("a force that is off is as one that is not there", "[switches]") {
  Registry registry({SIM_PLUGIN_DIR});
  for (const std::string part : kParts)
    for (const char* method : {"rk4", "verlet", "implicit_euler"}) {
      if (part.find("gust") != std::string::npos) continue;  // its memory is a part of the state
      INFO(part << " " << method);
      Simulation off = compiled(registry, cloth(part, ", on = false"), method);
      Simulation without = compiled(registry, cloth(part, ", on = false", ""), method);
      CHECK(off.switches() == std::vector<std::pair<std::string, bool>>{{"pull", false}});
      CHECK(without.switches().empty());
      REQUIRE((sim_test::run(off, 40) && sim_test::run(without, 40)));
      CHECK(off.hash() == without.hash());
      CHECK(off.energy().potential == without.energy().potential);
    }
}

TEST_CASE("a switch changes what comes and can be taken back", "[switches]") {
  Registry registry({SIM_PLUGIN_DIR});
  for (const std::string part : kParts)
    for (const char* method : {"rk4", "verlet", "trbdf2"}) {
      INFO(part << " " << method);
      Simulation on = compiled(registry, cloth(part), method),
                 toggled = compiled(registry, cloth(part), method);
      REQUIRE((sim_test::run(on, 20) && sim_test::run(toggled, 20)));
      REQUIRE(on.hash() == toggled.hash());
      toggled.set_switch("pull", false);
      REQUIRE((sim_test::run(on, 20) && sim_test::run(toggled, 20)));
      CHECK(on.hash() != toggled.hash());

      // The same again, from a timeline.
      Simulation third = compiled(registry, cloth(part), method);
      Timeline timeline(third);
      const auto go_on = [] { return true; };
      while (third.step_count() < 20) timeline.steps(third, 20 - third.step_count());
      timeline.edit(third, [](Simulation& system) { system.set_switch("pull", false); });
      while (third.step_count() < 40) timeline.steps(third, 40 - third.step_count());
      CHECK(third.hash() == toggled.hash());
      REQUIRE(timeline.go_to(third, 10, go_on));
      CHECK(third.switches()[0].second);
      REQUIRE(timeline.go_to(third, 40, go_on));
      CHECK_FALSE(third.switches()[0].second);
      CHECK(third.hash() == toggled.hash());
      REQUIRE(timeline.undo(third));
      while (third.step_count() < 40) timeline.steps(third, 40 - third.step_count());
      CHECK(third.hash() == on.hash());
    }
}

TEST_CASE("a checkpoint knows what is off", "[switches]") {
  Registry registry({SIM_PLUGIN_DIR});
  const SystemSpec spec = spec_of(cloth(kParts[1]));
  Simulation simulation(spec, registry);
  simulation.set_switch("pull", false);
  REQUIRE(sim_test::run(simulation, 10));
  Checkpoint saved;
  saved.systems.push_back(checkpoint(simulation, spec, 0));
  REQUIRE(sim_test::run(simulation, 10));

  const Checkpoint read = decode(encode(saved), "a.snap");
  Simulation other(spec, registry);
  resume(other, spec, read.systems[0], registry);
  CHECK_FALSE(other.switches()[0].second);
  REQUIRE(sim_test::run(other, 10));
  CHECK(other.hash() == simulation.hash());

  Checkpoint::System wrong = read.systems[0];
  wrong.off = {"push"};
  CHECK_THROWS_WITH(resume(other, spec, wrong, registry),
                    Catch::Contains("it turns off what the scene has no switch for"));
}

TEST_CASE("bad switches are told with their line", "[switches]") {
  Registry registry({SIM_PLUGIN_DIR});
  const auto error_of = [&](const std::string& text) {
    try {
      compiled(registry, text);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  CHECK(contains(error_of(cloth(kParts[0], "", "switches = { pull = 3 }, ")),
                 "expected one of the scene's forces or colliders, got 3"));
  CHECK(contains(error_of(cloth(kParts[0], "", "switches = { ['a b'] = pull }, ")),
                 "bad name of a switch"));
  CHECK(contains(error_of(cloth(kParts[0], "", "switches = 1, ")), "bad switches"));
  CHECK(contains(error_of(cloth(kParts[0], ", on = 1")), "expected true or false, got 1"));
  CHECK(contains(error_of(cloth(kParts[0], "", "switches = { pull = sim.force.drag { k = 1 } }, ")),
                 "expected one of the scene's forces or colliders"));

  Simulation simulation = compiled(registry, cloth(kParts[0]));
  CHECK_THROWS_WITH(simulation.set_switch("pul", false), Catch::Contains("did you mean 'pull'?"));
}
