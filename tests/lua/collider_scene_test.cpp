// Colliders and their motions in scenes: what they may say, and what is refused.
#include <cmath>

#include "core/geometry/rigid_motion.h"
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

std::string with(const std::string& collider, const std::string& more = "") {
  return "local p = sim.particles {}\np:add {0, 5, 0}\nlocal c = " + collider +
         "\nreturn sim.scene { particles = p, forces = {}, colliders = { c }, integrator = 'rk4', "
         "dt = 0.01, duration = 1 " +
         more + "}\n";
}

// The error that ends a run of up to so many steps.
std::optional<Error> run_error(const std::string& text, int steps) {
  const SceneFolder folder;
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec =
      load_scene(folder.write("scene.lua", "local sim = require \"sim\"\n" + text), registry,
                 {search_path(), {}, 0});
  Simulation system(spec.systems[0], registry);
  try {
    for (int n = 0; n < steps; ++n) system.step();
  } catch (const Error& error) {
    return error;
  }
  return {};
}

}  // namespace

TEST_CASE("colliders of every kind and motion can be said in a scene", "[lua][colliders]") {
  for (const std::string collider :
       {"sim.collider.sphere { radius = 1, friction = 0.3, restitution = 0.5, thickness = 0.01 }",
        "sim.collider.sphere { radius = 9, inside = true }",
        "sim.collider.box { half = {1, 2, 3}, center = {0, 1, 0}, turn = {0, 0, 0.3} }",
        "sim.collider.box { half = {9, 9, 9}, inside = true }",
        "sim.collider.capsule { a = {0, 0, 0}, b = {1, 0, 0}, radius = 0.2 }",
        "sim.collider.plane { normal = {0, 2, 0}, motion = sim.motion.spin { period = 2 } }",
        "sim.collider.sphere { radius = 1, motion = sim.motion.swing { amplitude = {1, 0, 0}, "
        "period = 2, phase = 1 } }",
        "sim.collider.sphere { radius = 1, motion = sim.motion.line { velocity = {1, 0, 0} } }",
        "sim.collider.sphere { radius = 1, motion = sim.motion.orbit { radius = 1, period = 2 } }",
        "sim.collider.sphere { radius = 1, motion = function(t) return {t, 0, 0} end }",
        "sim.collider.sphere { radius = 1, motion = function(t) return {t, 0, 0}, {1, 0, 0} end "
        "}"}) {
    const SystemSpec spec = load_text(with(collider)).systems[0];
    CHECK(spec.colliders.size() == 1);
    CHECK(spec.one_thread == (collider.find("function") != std::string::npos));
  }
}

TEST_CASE("bad colliders are refused at their lines", "[lua][colliders]") {
  struct Case {
    const char *collider, *says;
  };
  const Case cases[] = {
      {"sim.collider.sphere { radius = -1 }", "radius is -1"},
      {"sim.collider.sphere { radius = 0 }", "its radius is 0"},
      {"sim.collider.sphere { }", "'radius' is missing"},
      {"sim.collider.sphere { radius = 0/0 }", "finite"},
      {"sim.collider.sphere { radius = 1, friction = -0.1 }", "friction is -0.1"},
      {"sim.collider.sphere { radius = 1, restitution = 1.1 }", "restitution is 1.1"},
      {"sim.collider.sphere { radius = 1, restitution = -0.1 }", "restitution is -0.1"},
      {"sim.collider.sphere { radius = 1, thickness = -1 }", "thickness is -1"},
      {"sim.collider.plane { normal = {0, 0, 0} }", "no length"},
      {"sim.collider.plane { inside = true }", "no parameter 'inside'"},
      {"sim.collider.box { half = {1, 0, 1} }", "side of it has no length"},
      {"sim.collider.box { half = {1, -1, 1} }", "side of it has no length"},
      {"sim.collider.capsule { a = {0, 0, 0}, b = {1, 0, 0}, radius = 0 }", "radius is 0"},
      {"sim.collider.sphere { radius = 1, motion = 3 }", "motion is 3"},
      {"sim.collider.sphere { radius = 1, motion = sim.motion.swing { amplitude = {1, 0, 0}, "
       "period = 0 } }",
       "period is 0"},
      {"sim.collider.sphere { radius = 1, motion = sim.motion.spin { axis = {0, 0, 0}, period = 1 "
       "} }",
       "axis has no length"},
      {"sim.collider.sphere { radius = 1, motion = sim.motion.swung { } }", "swing"},
      {"sim.collider.plane { motion = sim.motion.spin { axis = {1, 0, 0}, period = 1 } }",
       "about its normal only"},
      {"sim.collider.sphere { radius = 6 }", "particle 0 starts 1 m inside"},
      {"sim.collider.sphere { radius = 1, motion = function(t) return nil end }",
       "parameter 'motion' of collider 'sphere'"},
      {"sim.collider.sphere { radius = 1, motion = function(t) return {0, 0} end }",
       "parameter 'motion' of collider 'sphere'"}};
  for (const Case& bad : cases) {
    INFO(bad.collider);
    const auto error = text_error(with(bad.collider));
    REQUIRE(error);
    CHECK(error->text().where == "scene.lua:4");
    CHECK(contains(error->what(), bad.says));
  }
}

TEST_CASE("a motion that gives out ends the run in that step", "[lua][colliders]") {
  for (const std::string last : {"nil", "{0/0, 0, 0}", "{0, 1e400, 0}", "{0, 0}", "'here'"}) {
    INFO(last);
    const std::string text =
        with("sim.collider.sphere { radius = 1,\nmotion = function(t) if t > 0.095 then return " +
             last + " end return {0, 0, 0}, {0, 0, 0} end }");
    CHECK_FALSE(run_error(text, 9));
    const auto error = run_error(text, 10);
    REQUIRE(error);
    CHECK(contains(error->what(), "scene.lua:5"));
    CHECK(contains(error->what(), "parameter 'motion' of collider 'sphere' at t = 0.1 s"));
  }
}

TEST_CASE("a function moves a solid as the same motion does", "[lua][colliders]") {
  // A ball of e = 1/2 hit by a sphere that swings; the function gives its velocity, or does not.
  const auto end_of = [](const std::string& motion) {
    const SceneSpec spec = load_text(
        "local p = sim.particles {}\np:add {0, 1.3, 0}\nreturn sim.scene { particles = p, forces = "
        "{ sim.force.gravity { g = {0, -9.81, 0} } }, colliders = { sim.collider.sphere { radius = "
        "1, restitution = 0.5, motion = " +
        motion + " } }, integrator = 'verlet', dt = 0.001, duration = 1 }");
    Registry registry({SIM_PLUGIN_DIR});
    Simulation system(spec.systems[0], registry);
    for (int n = 0; n < 600; ++n) REQUIRE(system.step());
    return system.position(0);
  };
  const Vec3 exact = end_of("sim.motion.swing { amplitude = {0, 0.2, 0}, period = 0.5 }");
  const std::string place = "{0, 0.2 * math.sin(4 * math.pi * t), 0}";
  const Vec3 known = end_of("function(t) return " + place +
                            ", {0, 0.8 * math.pi * math.cos(4 * math.pi * t), 0} end");
  const Vec3 differences = end_of("function(t) return " + place + " end");
  CHECK((known - exact).norm() < 1e-7);
  CHECK((differences - known).norm() < 1e-9);
  CHECK(exact.y() > 1.2);
}

TEST_CASE("a system says what a user should know of its colliders", "[lua][colliders]") {
  Registry registry({SIM_PLUGIN_DIR});
  const auto notes = [&](const std::string& text) {
    Simulation system(load_text(text).systems[0], registry);
    return system.ode().notes();
  };
  const auto by_differences =
      notes(with("sim.collider.sphere { radius = 1, motion = function(t) return {0, t, 0} end }"));
  REQUIRE(by_differences.size() == 1);
  CHECK(contains(by_differences[0], "by differences"));
  const auto pinned = notes(
      "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\nreturn sim.scene { particles = p, "
      "forces = {}, colliders = { sim.collider.sphere { radius = 1 } }, integrator = 'rk4', dt = "
      "0.01, duration = 1 }");
  REQUIRE(pinned.size() == 1);
  CHECK(contains(pinned[0], "particle 0 is inside collider 'sphere'"));
  CHECK(notes(with("sim.collider.sphere { radius = 1 }")).empty());
}
