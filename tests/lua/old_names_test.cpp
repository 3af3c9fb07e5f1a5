// Old names of the scene language: they work as the new ones, and the scene notes each of them
// once.
#include <catch2/catch.hpp>
#include <string>

#include "tests/lua/scene_text.h"

namespace {

using namespace sim;
using namespace sim::test;

// The hash at the end of a text, and its notes.
std::pair<std::uint64_t, std::vector<std::string>> run_text(const std::string& text) {
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec = load_text(text);
  Simulation system(spec.systems.front(), registry);
  for (int i = 0; i < 20; ++i) REQUIRE(system.step());
  return {system.hash(), spec.notes};
}

constexpr const char* kKick =
    "local p = sim.particles {}\np:add {0, 0, 0}\np:METHOD(0, sim.motion.line { velocity = {0, 1, "
    "0} })\np:add {0, -1, 0}\nlocal s = sim.force.spring { stiffness = 5 }\ns:tie(0, 1)\n"
    "return sim.scene { particles = p, forces = { s }, dt = 0.01, integrator = 'rk4', duration = 1 "
    "}";
constexpr const char* kBody =
    "local shape = sim.box { half = {0.1, 0.2, 0.3} }\nreturn sim.scene { bodies = { sim.rigid { "
    "shape = shape, mass = 1, ROTATION = {0.1, 0.2, 0.3}, ANGULAR = {1, 2, 3} },\n sim.rigid { "
    "shape "
    "= shape, mass = 1, position = {5, 0, 0}, ROTATION = {1, 0, 0} } },\n"
    "forces = {}, dt = 0.01, integrator = 'rk4', duration = 1 }";
constexpr const char* kCells =
    "local block = sim.grid { 2, 2, 2, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} }\n"
    "return sim.scene { particles = block, dt = 0.001, integrator = 'verlet', duration = 1, forces "
    "= {\n"
    "sim.force.FORCE { young = 10, cells = sim.cells { grid = block } } } }";

std::string with(std::string text, const std::string& word, const std::string& by) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at))
    text.replace(at, word.size(), by);
  return text;
}

}  // namespace

TEST_CASE("old names of the scene language mean the new ones and are noted once") {
  struct Case {
    std::string now, old;
    std::vector<std::string> notes;
  };
  const std::string body = with(with(kBody, "ROTATION", "rotation"), "ANGULAR", "angular_velocity");
  const Case cases[] = {
      {with(kKick, "METHOD", "prescribe"),
       with(kKick, "METHOD", "lead"),
       {"'particles:lead' is called 'particles:prescribe' now"}},
      {body,
       with(with(kBody, "ROTATION", "turn"), "ANGULAR", "spin"),
       {"'turn of sim.rigid' is called 'rotation' now", "'spin of sim.rigid' is called"}},
      {with(kCells, "FORCE", "fem"),
       with(kCells, "FORCE", "solid"),
       {"'sim.force.solid' is called 'sim.force.fem' now"}},
  };
  for (const Case& each : cases) {
    INFO(each.old);
    const auto now = run_text(each.now), old = run_text(each.old);
    CHECK(now.first == old.first);
    CHECK(now.second.empty());
    REQUIRE(old.second.size() == each.notes.size());
    for (const std::string& note : each.notes)
      CHECK(std::ranges::any_of(old.second, [&](const std::string& text) {
        return text.find("scene.lua:") != std::string::npos && text.find(note) != std::string::npos;
      }));
  }
}

TEST_CASE("an old name beside the new one is an error") {
  const auto error = text_error(
      "return sim.scene { forces = {}, dt = 0.01, integrator = 'rk4', duration = 1, bodies = { "
      "sim.rigid { mass "
      "= 1,"
      " shape = sim.sphere { radius = 1 }, spin = {0, 0, 1}, angular_velocity = {0, 0, 1} } } }");
  REQUIRE(error);
  CHECK_THAT(error->text().why, Catch::Contains("both angular_velocity and its old name spin"));
}

TEST_CASE("a body tells its state by the new names and the old ones") {
  const SceneSpec spec = load_text(
      "return sim.scene { forces = {}, dt = 0.01, integrator = 'rk4', duration = 1, bodies = { "
      "sim.rigid { mass "
      "= 1,"
      " shape = sim.sphere { radius = 1 }, rotation = {0, 1, 0}, angular_velocity = {0, 0, 3} } "
      "},\n"
      "observe = { same = function(s) local b = s:body(0)\n"
      "return (b.spin[3] == 3 and b.angular_velocity[3] == 3 and b.rotation[3] == b.turn[3] and "
      "b.rotation[3] > 0.4) and 1 or 0 end } }");
  Registry registry({SIM_PLUGIN_DIR});
  Simulation system(spec.systems.front(), registry);
  CHECK(spec.systems.front().observe(system).front() == 1);
}
