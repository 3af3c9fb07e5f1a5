// An argument in one unit for a parameter in another.
#include "core/lua/scene/argument_units.h"

#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

// A spring of a scene: declarations stand on line 2, its own table begins on line 4.
std::string spring_scene(const std::string& declarations, const std::string& fields) {
  return declarations + "\nlocal p = sim.particles { mass = 1 }\nlocal s = sim.force.spring {\n" +
         fields +
         " }\np:add { 0, 0, 0 }\np:add { 1, 0, 0 }\np:pin(0)\ns:tie(0, 1)\n"
         "return sim.scene { name = 's', particles = p, forces = { s }, integrator = 'rk4',\n"
         "  dt = 0.01, duration = 1 }\n";
}

void refused(const std::string& declarations, const std::string& fields, const std::string& why) {
  INFO(declarations << "\n" << fields);
  try {
    load_text(spring_scene(declarations, fields));
  } catch (const Error& error) {
    CHECK(error.kind() == ErrorKind::kScene);
    CHECK(error.text().what == "wrong unit");
    CHECK(error.text().where.find(".lua:5") != std::string::npos);
    CHECK(error.text().why == why);
    CHECK(error.text().remedy.find("sim.arg") != std::string::npos);
    return;
  }
  FAIL_CHECK("it is loaded");
}

void accepted(const std::string& declarations, const std::string& fields) {
  INFO(declarations << "\n" << fields);
  CHECK_NOTHROW(load_text(spring_scene(declarations, fields)));
}

}  // namespace

TEST_CASE("an argument in another unit than its parameter is refused with both names") {
  const std::string why = "'rest' of sim.force.spring is in m, argument 'k' in N/m";
  refused("local k = sim.arg('k', 50, 'N/m')", "stiffness = 10, rest = k", why);
  refused("local k = sim.arg('k', 50, 'of the spring, N/m')", "stiffness = k, rest = k", why);
  refused("local k <const> = sim.arg(\"k\", 50, [[N/m; of the spring]])",
          "stiffness = 10; rest = k; family = 'x'", why);
  refused("", "stiffness = 10, rest = sim.arg('k', 50, 'N/m')", why);
  refused("local l, k = sim.arg('l', 1, 'm'), sim.arg('k', 50, 'N/m')", "stiffness = 10, rest = k",
          why);
  refused("local length = sim.arg('l', 1, 'm')", "rest = length, stiffness = length",
          "'stiffness' of sim.force.spring is in N/m, argument 'l' in m");
  // The same quantity, a thousand times too large.
  refused("local l = sim.arg('l', 5, 'rest length, mm')", "stiffness = 10, rest = l",
          "'rest' of sim.force.spring is in m, argument 'l' in mm");
}

TEST_CASE("arguments in the unit of the parameter, or in none that is known, pass") {
  accepted("local k, l = sim.arg('k', 50, 'N/m'), sim.arg('l', 1, 'of it, m')",
           "stiffness = k, rest = l");
  accepted("local k = sim.arg('k', 50, 'kg/s^2')", "stiffness = k");
  accepted("local k = sim.arg('k', 50, 'how stiff it is')", "stiffness = 10, rest = k");
  accepted("local k = sim.arg('k', 50)", "stiffness = 10, rest = k");
  accepted("local k = sim.arg('k', 50, 'm, or N/m')", "stiffness = 10, rest = k");
}

TEST_CASE("what is calculated, or has several meanings, has no unit that is known") {
  accepted("local k = sim.arg('k', 50, 'N/m')", "stiffness = 10, rest = 1 / k");
  accepted("local k = sim.arg('k', 50, 'N/m')", "stiffness = 10, rest = k * 0.1");
  accepted("local k = sim.arg('k', 50, 'N/m') / 50", "stiffness = 10, rest = k");
  accepted("local k = sim.arg('k', 50, 'N/m') k = 1", "stiffness = 10, rest = k");
  accepted("local k = sim.arg('k', 50, 'N/m') local j, k = 1, 2", "stiffness = 10, rest = k");
  accepted("local k = sim.arg('k', 50, 'N/m') local function f(k) return k end",
           "stiffness = 10, rest = k");
  accepted("local k = sim.arg('k', 50, 'N/m') for k = 1, 2 do end", "stiffness = 10, rest = k");
  // Keys and members of that name are no assignments, words in texts and comments no code.
  refused("local k = sim.arg('k', 50, 'N/m') local t = { k = 1 } t.k = 2",
          "stiffness = 10, rest = k", "'rest' of sim.force.spring is in m, argument 'k' in N/m");
  accepted("local l = sim.arg('l', 1, 'm') --[[ local k = sim.arg('k', 5, 'N/m') ]]",
           "stiffness = 10, rest = l, family = ' rest = k '");
  accepted("local k = sim.arg('k', 50, 'N/m') local f = function() k = 2 end",
           "stiffness = 10, rest = k");
}
