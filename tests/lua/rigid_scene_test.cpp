// Rigid bodies in scenes: what they may say, and what is refused.
#include <cmath>

#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

const std::string kBall = "sim.rigid { shape = sim.sphere { radius = 0.5 }, mass = 2 }";
const std::string kUntouched =
    "sim.rigid { shape = sim.sphere { radius = 0.5 }, mass = 2, touches = false }";

std::string with(const std::string& body, const std::string& more = "",
                 const std::string& before = "") {
  return before + "local b = " + body +
         "\nreturn sim.scene { bodies = { b }, forces = {}, integrator = 'rk4', dt = 0.01, "
         "duration "
         "= 1, " +
         more + " }\n";
}

}  // namespace

TEST_CASE("rigid bodies of every shape can be said in a scene", "[lua][rigid]") {
  const double pi = std::acos(-1.0);
  const struct {
    std::string shape;
    double volume;
  } cases[] = {
      {"sim.sphere { radius = 0.5 }", pi / 6},
      {"sim.box { half = {1, 2, 3} }", 48},
      {"sim.capsule { radius = 0.5, length = 2 }", pi / 6 + pi / 2},
      {"sim.mesh { points = { {0,0,0}, {1,0,0}, {0,1,0}, {0,0,1} }, triangles = { {0,2,1}, "
       "{0,1,3}, {0,3,2}, {1,2,3} } }",
       1.0 / 6},
      {"sim.compound { { sim.sphere { radius = 0.5 }, at = {0, 0, 2} }, { sim.box { half = {1, 2, "
       "3} }, rotation = {1, 2, 3} } }",
       pi / 6 + 48}};
  for (const auto& each : cases) {
    const SceneSpec spec = load_text(
        with("sim.rigid { shape = " + each.shape +
             ", density = 3, position = {1, 2, 3}, rotation = {0, 0, 1}, velocity = {1, 0, "
             "0}, angular_velocity = {0, 1, 0}, friction = 0.5, restitution = 1 }"));
    CHECK(spec.systems[0].bodies[0].mass == Approx(3 * each.volume).epsilon(1e-14));
    CHECK(spec.systems[0].particles->count() == 4);
  }
}

TEST_CASE("a scene of hundreds of bodies is read whole", "[lua][rigid]") {
  for (const char* count : {"40", "100", "300"}) {
    const SceneSpec spec =
        load((search_path()[0] / "scenes/stack.lua").string(), {{"n", count}, {"lean", "0.25"}});
    const std::vector<RigidSpec>& bodies = spec.systems[0].bodies;
    REQUIRE(bodies.size() == std::stoul(count));
    for (std::size_t i = 0; i < bodies.size(); ++i)
      CHECK(bodies[i].position ==
            Vec3{0.25 * static_cast<double>(i), static_cast<double>(i) + 0.5, 0});
  }
}

TEST_CASE("parts nested in parts are read to any depth or refused, whichever is wrong first",
          "[lua][attack]") {
  for (const std::string depth : {"20", "100", "2000"})
    CHECK(contains(said("local p = sim.particles { mass = 1 }\np:add {0, 3, 0}\n"
                        "local c = sim.collider.sphere { radius = 1 }\nfor i = 1, " +
                        depth +
                        " do c = sim.collider.sphere { radius = 1, motion = c } end\n"
                        "return sim.scene { particles = p, forces = {}, colliders = { c }, "
                        "integrator = 'rk4', dt = 0.01, duration = 1 }"),
                   depth.size() < 4 ? "motion is a collider" : "nested too deeply"));
}

TEST_CASE("points of bodies stand wherever particles are joined", "[lua][rigid]") {
  const std::string p = "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\n";
  for (const std::string part :
       {"forces = { sim.force.spring { stiffness = 1, ties = { {b:at {0, 0, 1}, 0} } } }",
        "forces = { sim.force.spring { stiffness = 1 }:tie(0, b:at {0, 0, 1}, { damping = 1 }) }",
        "forces = { sim.force.expression { energy = 'r^2', ties = { {b:at {1, 0, 0}, 0} } } }",
        "forces = {}, constraints = { sim.constraint.distance { ties = { {b:at {0, 1, 0}, 0} } } }",
        "forces = {}, constraints = { sim.constraint.on_plane { particles = { b:at {0, 1, 0} }, "
        "point = {0, 1, 0}, normal = {0, 1, 0} } }"}) {
    const std::string text = p + "local b = " + kUntouched +
                             "\nreturn sim.scene { particles = p, bodies = "
                             "{ b }, integrator = 'rk4', dt = 0.01, duration = 1, " +
                             part + " }\n";
    CHECK(load_text(text).systems[0].points.size() == 1);
  }
}

TEST_CASE("mistakes with rigid bodies are named with their line", "[lua][rigid]") {
  CHECK(contains(said(with("sim.rigid { mass = 1 }")), "expected a sim.box"));
  CHECK(contains(said(with("sim.rigid { shape = sim.sphere { radius = 1 } }")),
                 "either mass or density"));
  CHECK(
      contains(said(with("sim.rigid { shape = sim.sphere { radius = 1 }, mass = 1, density = 1 }")),
               "either mass or density"));
  CHECK(contains(said(with("sim.rigid { shape = sim.sphere { radius = 1 }, mass = 0 }")),
                 "bad mass of a body"));
  CHECK(contains(said(with("sim.rigid { shape = sim.sphere { radius = 1 }, mas = 1 }")), "'mass'"));
  CHECK(contains(said(with("sim.rigid { shape = sim.sphere { radius = -1 }, mass = 1 }")),
                 "bad radius"));
  CHECK(contains(said(with("sim.rigid { shape = sim.box { half = {1, 0, 1} }, mass = 1 }")),
                 "bad half"));
  CHECK(contains(said(with("sim.rigid { shape = sim.sphere { radius = 1 }, mass = 1, restitution = "
                           "2 }")),
                 "restitution"));
  CHECK(contains(said(with("sim.rigid { shape = sim.box { half = {1, 1e-9, 1} }, mass = 1 }")),
                 "no thickness"));
  CHECK(contains(said(with("sim.rigid { shape = sim.sphere { radius = 1 }, mass = 1, position = "
                           "{1e308, 0, 0}, velocity = {0/0, 0, 0} }")),
                 "velocity of a body"));
  CHECK(contains(said(with("sim.rigid { mass = 1, shape = sim.mesh { points = { {0,0,0}, {1,0,0}, "
                           "{0,1,0}, {0,0,1} }, triangles = { {0,2,1}, {0,1,3}, {0,3,2} } } }")),
                 "not closed"));
  CHECK(
      contains(said(with("sim.rigid { density = 1, shape = sim.mesh { points = { {0,0,0}, {1,0,0}, "
                         "{0,1,0}, {0,0,1} }, triangles = { {0,1,2}, {0,3,1}, {0,2,3}, {1,3,2} } "
                         "} }")),
               "volume"));
  const auto compound = [&](const std::string& parts) {
    return said(with("sim.rigid { mass = 1, shape = sim.compound " + parts + " }"));
  };
  CHECK(contains(compound("{}"), "1 to 100 parts"));
  CHECK(contains(compound("{ sim.sphere { radius = 1 } }"), "bad part 1 of sim.compound"));
  CHECK(contains(compound("{ { 3 } }"), "bad shape of part 1 of sim.compound"));
  CHECK(contains(compound("{ { sim.compound { { sim.sphere { radius = 1 } } } } }"),
                 "bad shape of part 1 of sim.compound"));
  CHECK(contains(compound("{ { sim.sphere { radius = 1 }, at = {1, 2} } }"), "bad at of part 1"));
  CHECK(contains(compound("{ { sim.sphere { radius = 1 }, add = {1, 2, 3} } }"), "'add'"));
  CHECK(contains(compound("{ sim = 1, { sim.sphere { radius = 1 } } }"), "'sim'"));
  CHECK(contains(said("return sim.scene { bodies = {}, forces = {}, integrator = 'rk4', dt = 1, "
                      "duration = 1 }\n"),
                 "list is empty"));
  CHECK(contains(said("local b = " + kBall +
                      "\nreturn sim.scene { bodies = { b, b }, forces = {}, "
                      "integrator = 'rk4', dt = 1, duration = 1 }\n"),
                 "in the list already"));
  CHECK(contains(said("local b, c = " + kBall + ", " + kBall +
                      "\nreturn sim.scene { bodies = { b }, integrator = 'rk4', dt = 1, duration = "
                      "1, forces = { sim.force.spring { stiffness = 1, ties = { {b:at {0, 0, 0}, "
                      "c:at {0, 0, 0}} } } } }\n"),
                 "not in this scene"));
  const std::string tie =
      "local s = sim.force.spring { stiffness = 1 }\nlocal q = b:at {0, 0, 0}\n";
  CHECK(contains(said("local b = " + kBall + "\n" + tie + "s:tie(q, q)\n"), "tied to itself"));
  CHECK(contains(said("local b = " + kBall + "\nb:at(1)\n"), "point of a body"));
}

TEST_CASE("observers see bodies", "[lua][rigid]") {
  const SceneSpec spec = load_text(
      with("sim.rigid { shape = sim.box { half = {1, 2, 3} }, mass = 1, position = {1, 2, 3}, "
           "rotation = "
           "{0, 0, 1}, velocity = {4, 5, 6}, angular_velocity = {0.7, 0.8, 0.9} }",
           "observe = { x = function(s) return s:body(0).position[2] end, q = function(s) return "
           "s:body(0).turn[4] end, v = function(s) return s:body(0).velocity[3] end, w = "
           "function(s) return s:body(0).spin[1] end }"));
  Registry registry({SIM_PLUGIN_DIR});
  const Simulation system(spec.systems[0], registry);
  const std::vector<double> seen = spec.systems[0].observe(system);
  CHECK(seen[0] == Approx(std::sin(0.5)));
  CHECK(seen[1] == Approx(6));
  CHECK(seen[2] == Approx(0.7));
  CHECK(seen[3] == Approx(2));
}
