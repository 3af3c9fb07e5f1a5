// Constraints in scenes: what they may say, and what is refused.
#include <cmath>

#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

std::string with(const std::string& constraint, const std::string& points = "{0, 0, 0}, {1, 0, 0}",
                 const std::string& more = "") {
  return "local p = sim.particles {}\nfor _, x in ipairs { " + points + " } do p:add(x) end\n" +
         more + "local c = " + constraint +
         "\nreturn sim.scene { particles = p, forces = {}, constraints = { c }, integrator = "
         "'rk4', dt = 0.01, duration = 1 }\n";
}

}  // namespace

TEST_CASE("constraints of every kind can be said in a scene", "[lua][constraints]") {
  for (const std::string constraint :
       {"sim.constraint.distance { ties = { {0, 1} }, length = 1 }",
        "sim.constraint.distance {}:tie(0, 1)",
        "sim.constraint.distance {}:tie(0, 1, { length = 1 })",
        "sim.constraint.on_plane { particles = {0, 1}, point = {0, 0, 0}, normal = {0, 1, 0} }",
        "sim.constraint.on_plane { particles = p, point = function(t) return {0, t, 0} end }",
        "sim.constraint.on_sphere { particles = {1}, radius = 1, center = {0, 0, 0} }",
        "sim.constraint.on_circle { particles = {1}, radius = 1, axis = {0, 0, 1} }",
        "sim.constraint.on_curve { particles = {1}, curve = function(s) return {s, 0, 0} end }",
        "sim.constraint.weld { particles = {0, 1} }"})
    CHECK(load_text(with(constraint)).systems[0].constraints.size() == 1);
  const SceneSpec grid = load_text(
      "local g = sim.grid { 3, 4, du = {1, 0, 0}, dv = {0, 0, 2} }\nreturn sim.scene { particles = "
      "g, forces = {}, constraints = { sim.constraint.distance { grid = g, offsets = { {0, 1}, {1, "
      "0} } } }, integrator = 'verlet', dt = 0.01, duration = 1 }\n");
  CHECK(grid.systems[0].constraints[0].elements.count() == 17);
}

TEST_CASE("bad constraints are refused", "[lua][constraints]") {
  struct Case {
    std::string text, says;
  };
  const Case cases[] = {
      {with("sim.constraint.distance {}"), "it joins nothing"},
      {with("sim.constraint.distance { ties = { {0, 7} } }"), "there is no particle 7"},
      {with("sim.constraint.distance { ties = { {0, 1} }, length = 0 }"), "rod 0-1 is of length 0"},
      {with("sim.constraint.distance { ties = { {0, 1} } }", "{1, 0, 0}, {1, 0, 0}"),
       "rod 0-1 is of length 0"},
      {with("sim.constraint.distance { ties = { {0, 1} }, length = 1 }", "{1, 0, 0}, {1, 0, 0}"),
       "no direction at the start"},
      {with("sim.constraint.distance { ties = { {0,1}, {1,2}, {0,2, length = 3} }, length = 1 }",
            "{0, 0, 0}, {1, 0, 0}, {2, 0, 0}"),
       "constraints that cannot be met"},
      {with("sim.constraint.distance { ties = { {0, 1} }, length = 2 }", "{0, 0, 0}, {1, 0, 0}",
            "p:pin(0, 1)\n"),
       "joins pinned particles alone"},
      {with("sim.constraint.on_sphere { particles = {1}, radius = 0 }"), "its radius is 0"},
      {with("sim.constraint.on_plane { particles = {1}, normal = {0, 0, 0} }"), "its normal is 0"},
      {with("sim.constraint.on_circle { particles = {1}, radius = 1, axis = {0, 0, 0} }"),
       "its axis is 0"},
      {with("sim.constraint.weld { particles = {1} }"), "it joins one particle"},
      {with("sim.constraint.on_curve { particles = {1}, curve = function(s) return {math.abs(s - "
            "1) + 1, s - 1, 0} end }"),
       "a kink"},
      {with("sim.constraint.on_curve { particles = {1}, curve = function(s) return s end }"),
       "expected a vector"},
      {with("sim.constraint.on_plane {}"), "it joins nothing"},
      {with("sim.force.gravity {}"), "expected a sim.constraint.NAME"},
      {with("sim.constraint.distanse {}"), "distance"}};
  for (const Case& each : cases) {
    INFO(each.text);
    CHECK_THAT(said(each.text), Catch::Contains(each.says));
  }
}

TEST_CASE("a start off the constraints is put back, and said", "[lua][constraints]") {
  const SceneSpec spec = load_text(
      "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\np:add({1.001, 0, 0}, { velocity = "
      "{1, "
      "2, 0} })\nreturn sim.scene { particles = p, forces = {}, constraints = { "
      "sim.constraint.distance { ties = { {0, 1} }, length = 1 } }, integrator = 'rk4', dt = 0.01, "
      "duration = 1 }\n");
  Registry registry({SIM_PLUGIN_DIR});
  Simulation system(spec.systems[0], registry);
  const std::vector<std::string> notes = system.ode().notes();
  REQUIRE(notes.size() == 2);
  CHECK_THAT(notes[0], Catch::Contains("moved particles by up to 0.001 m"));
  CHECK_THAT(notes[1], Catch::Contains("took 0.5 J at the start"));
  CHECK(system.position(1).x() == Approx(1).epsilon(1e-14));
  CHECK(std::abs(system.velocity(1).x()) < 1e-15);
}

TEST_CASE("methods that cannot keep constraints say why", "[lua][constraints]") {
  const SceneSpec spec = load_text(with("sim.constraint.distance { ties = { {0, 1} } }"));
  Registry registry({SIM_PLUGIN_DIR});
  for (const char* method : {"pefrl", "projective_dynamics"}) {
    INFO(method);
    CHECK_THROWS_WITH(Simulation(spec.systems[0], registry, {.integrator = {method}}),
                      Catch::Contains("this scene has constraints"));
  }
  CHECK_THROWS_WITH(Simulation(spec.systems[0], registry,
                               {.integrator = {"rk4", {{"precision", std::string("single")}}}}),
                    Catch::Contains("constraints are double precision only"));
}

TEST_CASE("a bead that comes to a kink of its wire stops there, with words", "[lua][constraints]") {
  // It starts at the origin, where only its way says what is small.
  const SceneSpec spec = load_text(
      "local p = sim.particles {}\np:add {0, 0, 0}\nreturn sim.scene { particles = p, forces = { "
      "sim.force.gravity { g = {3, -9.81, 0} } }, constraints = { sim.constraint.on_curve { "
      "particles = {0}, curve = function(s) return {s, s < 2 and -s or s - 4, 0} end } }, "
      "integrator = 'rk4', dt = 0.01, duration = 1 }\n");
  Registry registry({SIM_PLUGIN_DIR});
  for (const char* method : {"rk4", "verlet"}) {
    INFO(method);
    Simulation system(spec.systems[0], registry, {.integrator = {method}});
    int steps = 0;
    while (steps < 200 && system.step()) ++steps;
    CHECK(steps > 50);
    CHECK(steps < 100);
    CHECK_THAT(system.divergence().why, Catch::Contains("a kink"));
    CHECK(system.position(0).allFinite());
  }
}

// Roundings of places far from the origin are coarser than what the nearest place is found to.
TEST_CASE("a bead slides on a wire far from the origin", "[lua][constraints]") {
  for (const char* const method : {"rk4", "verlet"}) {
    INFO(method);
    TextRun scene(
        "local p = sim.particles { mass = 2 }\np:add {1e6 + 1, 0, 0}\n"
        "return sim.scene { particles = p, forces = { sim.force.gravity {} }, constraints = {\n"
        "  sim.constraint.on_curve { particles = {0}, from = -7, to = 7,\n"
        "  curve = function(s) return { 1e6 + math.cos(s), math.sin(s), 0 } end } },\n"
        "  integrator = 'rk4', dt = 0.005, duration = 1 }\n",
        method, 0.005);
    double lowest = 0;
    for (int i = 0; i < 200; ++i) {
      REQUIRE(scene.system.step());
      const Vec3 x = scene.system.position(0) - Vec3(1e6, 0, 0), v = scene.system.velocity(0);
      CHECK(x.norm() == Approx(1).margin(1e-8));
      CHECK(std::fabs(x.dot(v)) < 1e-6);
      CHECK(0.5 * v.squaredNorm() + 9.81 * x.y() == Approx(0).margin(2e-3));
      lowest = std::min(lowest, x.y());
    }
    CHECK(lowest < -0.99);
  }
}

TEST_CASE("feedback instead of putting back keeps the order, and lets a little through",
          "[lua][constraints]") {
  const auto run = [](const std::string& more, double dt) {
    const SceneSpec spec = load_text(
        "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\np:add {1, 0, 0}\nreturn sim.scene "
        "{ "
        "particles = p, forces = { sim.force.gravity { g = {0, -9.81, 0} } }, constraints = { "
        "sim.constraint.distance { ties = { {0, 1} }" +
        more + " } }, integrator = 'rk4', dt = 0.01, duration = 1 }\n");
    Registry registry({SIM_PLUGIN_DIR});
    Simulation system(spec.systems[0], registry, {.dt = dt});
    while (system.t() < 1 - 1e-9) system.step();
    return system.position(1);
  };
  const Vec3 exact = run("", 0.0005);
  const double coarse = (run(", feedback = 10", 0.02) - exact).norm();
  const double fine = (run(", feedback = 10", 0.01) - exact).norm();
  CHECK(std::abs(std::log2(coarse / fine) - 4) < 0.3);
  const double off = std::abs(run(", feedback = 10", 0.02).norm() - 1);
  CHECK(off > 1e-14);
  CHECK(off < 1e-5);
}
