// Collisions of rigid bodies beyond planes and each other: round colliders, boxes, convex meshes,
// and single particles.
#include <cmath>

#include "plugins/contact/bodies/collide_boxes.h"
#include "tests/lua/scene_text.h"
#include "tests/support/allocations.h"
#include "tests/support/momentum.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;
using sim_test::Momentum;
using sim_test::momentum_of;

namespace {

std::string scene_of(const std::string& before, const std::string& keys, bool gravity = true) {
  return before + "\nreturn sim.scene { " + keys + ", forces = { " +
         (gravity ? "sim.force.gravity { g = {0, -9.81, 0} }" : "") +
         " }, integrator = 'verlet', dt = 0.01, duration = 1 }\n";
}

// A cube of 1 m as a mesh, each side two triangles.
const char* const kCube =
    "local function cube(a) return sim.mesh { points = { {-a,-a,-a}, {a,-a,-a}, {-a,a,-a}, "
    "{a,a,-a}, {-a,-a,a}, {a,-a,a}, {-a,a,a}, {a,a,a} }, triangles = { {0,4,6}, {0,6,2}, {1,3,7}, "
    "{1,7,5}, {0,1,5}, {0,5,4}, {2,6,7}, {2,7,3}, {0,2,3}, {0,3,1}, {4,5,7}, {4,7,6} } } end\n";

const char* const kOctahedron =
    "local function octahedron(a) return sim.mesh { points = { {a,0,0}, {-a,0,0}, {0,a,0}, "
    "{0,-a,0}, {0,0,a}, {0,0,-a} }, triangles = { {0,2,4}, {2,1,4}, {1,3,4}, {3,0,4}, {2,0,5}, "
    "{1,2,5}, {3,1,5}, {0,3,5} } } end\n";

}  // namespace

TEST_CASE("a box slides on a box that leans as on a plane", "[rigid]") {
  const auto slid = [](const std::string& collider, double friction) {
    const std::string mu = std::to_string(friction);
    TextRun scene(
        scene_of(
            "local n = { -math.sin(0.4), math.cos(0.4), 0 }\nlocal b = sim.rigid { shape = "
            "sim.box { half = {0.3, 0.1, 0.2} }, mass = 2, rotation = {0, 0, 0.4}, position = { "
            "0.1 * n[1], 0.1 * n[2], 0 }, friction = " +
                mu + " }",
            "bodies = { b }, colliders = { " + collider + ", friction = " + mu + " } }"),
        "verlet", 0.01);
    scene.run_to(1);
    CHECK(scene.system.body_state(0).angular_velocity.norm() < 1e-12);
    return -scene.system.body_state(0).center.dot(Vec3(std::cos(0.4), std::sin(0.4), 0));
  };
  const std::string box =
      "sim.collider.box { half = {9, 1, 9}, turn = {0, 0, 0.4}, center = { 1.05 * "
      "math.sin(0.4), "
      "-1.05 * math.cos(0.4), 0 }, thickness = 0.05";
  for (const double mu : {0.3, 0.5}) {
    const double expected =
        mu > std::tan(0.4) ? 0 : 0.5 * 9.81 * (std::sin(0.4) - mu * std::cos(0.4));
    CHECK(slid("sim.collider.plane { normal = n", mu) == Approx(expected).margin(1e-12));
    CHECK(slid(box, mu) == Approx(expected).margin(1e-11));
  }
}

// Impulses are kept from step to step by these names.
TEST_CASE("the contact points of boxes keep their names where these turn a little", "[rigid]") {
  RigidShape shape;
  shape.form = RigidShape::Form::kBox;
  shape.half = {0.1, 0.1, 0.1};
  std::vector<int> first;
  for (const double turn : {0.0, 1e-6, -1e-6, 3e-6, -3e-6}) {
    Placed below, above;
    below.shape = above.shape = &shape;
    above.center = {0.013, 0.2, 0.007};
    above.axes = {{1, -turn, 0}, {turn, 1, 0}, {0, 0, 1}};
    std::vector<ManifoldPoint> points;
    collide_boxes(below, above, 1e-3, points);
    std::vector<int> names;
    for (const ManifoldPoint& point : points) names.push_back(point.feature);
    CHECK(names.size() == 4);
    if (first.empty()) first = names;
    CHECK(names == first);
  }
}

TEST_CASE("a box lies on a smaller box and on a capsule, and falls from where it must", "[rigid]") {
  const auto ends = [](const std::string& collider, double x) {
    TextRun scene(scene_of("local b = sim.rigid { shape = sim.box { half = {0.5, 0.1, 0.5} }, mass "
                           "= 1, friction = 0.5, position = { " +
                               std::to_string(x) + ", 0.1, 0 } }",
                           "bodies = { b }, colliders = { " + collider + " }"),
                  "verlet", 0.005);
    scene.run_to(1);
    return scene.system.body_state(0);
  };
  const std::string table =
      "sim.collider.box { half = {0.2, 1, 0.2}, center = {0, -1, 0}, "
      "friction = 0.5 }";
  const RigidState lies = ends(table, 0.1);
  CHECK((lies.center - Vec3(0.1, 0.1, 0)).norm() < 1e-11);
  CHECK(lies.velocity.norm() + lies.angular_velocity.norm() < 1e-10);
  CHECK(ends(table, 0.3).center.y() < 0);  // its center is beyond the edge
  // On two capsules side by side.
  const std::string rails =
      "sim.collider.capsule { a = {-0.3, -0.1, -2}, b = {-0.3, -0.1, 2}, radius = 0.1, friction = "
      "0.5 }, sim.collider.capsule { a = {0.3, -0.1, -2}, b = {0.3, -0.1, 2}, radius = 0.1, "
      "friction = 0.5 }";
  const RigidState rests = ends(rails, 0.1);
  CHECK((rests.center - Vec3(0.1, 0.1, 0)).norm() < 1e-11);
  CHECK(ends(rails, 0.5).center.y() < 0.05);
}

// It touches at both ends of its part above the face, and tips where its middle is beyond.
TEST_CASE("a capsule lies across what is narrower, and falls from where it must", "[rigid]") {
  const auto ends = [](const std::string& under, const std::string& colliders, double x) {
    TextRun scene(
        scene_of(
            kCube + under +
                "local b = sim.rigid { shape = sim.capsule { radius = 0.1, length = 1.6 }, mass "
                "= 1, friction = 0.5, rotation = {0, 0, math.pi / 2}, position = { " +
                std::to_string(x) + ", 0.1, 0 } }",
            "bodies = { b" + std::string(under.empty() ? "" : ", table") + " }, colliders = { " +
                colliders + " }"),
        "verlet", 0.005);
    scene.run_to(0.8);
    return scene.system.body_state(0);
  };
  const std::string fixed = "sim.collider.box { half = {0.3, 1, 0.3}, center = {0, -1, 0} }",
                    floor = "sim.collider.plane { point = {0, -0.6, 0}, friction = 1 }";
  const auto table = [](const std::string& shape) {
    return "local table = sim.rigid { shape = " + shape +
           ", mass = 50, position = {0, -0.3, 0}, friction = 0.5 }\n";
  };
  for (const auto& [under, colliders] : {std::pair{std::string(), fixed},
                                         {table("sim.box { half = {0.3, 0.3, 0.3} }"), floor},
                                         {table("cube(0.3)"), floor}}) {
    CAPTURE(under);
    for (const double x : {0.0, 0.1, -0.25}) {
      const RigidState lies = ends(under, colliders, x);
      CHECK((lies.center - Vec3(x, 0.1, 0)).norm() < 1e-6);
      CHECK(lies.velocity.norm() + lies.angular_velocity.norm() < 1e-6);
    }
    for (const double x : {0.4, -0.4}) CHECK(ends(under, colliders, x).center.y() < 0.05);
  }
}

TEST_CASE("a box that hits a ball in the middle goes back as Newton says", "[rigid]") {
  for (const char* shape : {"sim.box { half = {0.2, 0.1, 0.3} }", "octahedron(0.2)",
                            "sim.capsule { radius = 0.2, length = 0.4 }"}) {
    INFO(shape);
    TextRun scene(
        scene_of(std::string(kOctahedron) + "local b = sim.rigid { shape = " + shape +
                     ", mass = 3, restitution = 0.5, position = {-1, 0, 0}, velocity = {2, 0, 0} }",
                 "bodies = { b }, colliders = { sim.collider.sphere { radius = 0.3, center = {0, "
                 "0, 0} } }",
                 false),
        "verlet", 0.01);
    scene.run_to(1);
    const RigidState state = scene.system.body_state(0);
    CHECK((state.velocity - Vec3(-1, 0, 0)).norm() < 1e-9);
    CHECK(state.angular_velocity.norm() < 1e-9);
    CHECK(state.center.x() == Approx(-0.5 - 0.75).margin(1e-9));
    CHECK(scene.system.contact_work().lost == Approx(0.5 * 3 * 3).epsilon(1e-9));
  }
}

TEST_CASE("cubes as meshes stand on each other as boxes do", "[rigid]") {
  TextRun scene(scene_of(std::string(kCube) +
                             "local b = {}\nfor i = 1, 5 do b[i] = sim.rigid { shape = i % 2 == 0 "
                             "and sim.box { half = {0.5, 0.5, 0.5} } or cube(0.5), mass = 1, "
                             "friction = 0.5, position = { 0.05 * i, i - 0.5, 0 } } end",
                         "bodies = b, colliders = { sim.collider.plane { friction = 0.5 } }"),
                "verlet", 0.005);
  scene.run_to(3);
  for (int i = 0; i < 5; ++i)
    CHECK((scene.system.body_state(i).center - Vec3(0.05 * (i + 1), i + 0.5, 0)).norm() < 1e-6);
}

TEST_CASE("momentum stays when meshes, other bodies and particles hit each other", "[rigid]") {
  const std::string text = scene_of(
      std::string(kCube) + kOctahedron +
          "local p = sim.particles { mass = 0.1 }\n"
          "for i = 0, 19 do p:add({ math.sin(3 * i), math.sin(5 * i + 1), math.sin(7 * i + 2) }, "
          "{ velocity = { -2 * math.sin(3 * i), -2 * math.sin(5 * i + 1), -2 * math.sin(7 * i + 2) "
          "} }) end\n"
          "local b = {\n"
          "sim.rigid { shape = cube(0.3), mass = 1, position = {-2, 0.1, 0}, velocity = {3, 0, "
          "0.1}, angular_velocity = {1, 2, 3}, friction = 0.4, restitution = 0.5 },\n"
          "sim.rigid { shape = octahedron(0.4), mass = 2, position = {2, 0, 0}, velocity = {-3, 0, "
          "0}, angular_velocity = {0, 1, -2}, friction = 0.4 },\n"
          "sim.rigid { shape = sim.sphere { radius = 0.3 }, mass = 1, position = {0, 2, 0}, "
          "velocity = {0, -3, 0}, friction = 0.4 },\n"
          "sim.rigid { shape = sim.capsule { radius = 0.15, length = 0.5 }, mass = 1, position = "
          "{0, -2, 0}, velocity = {0, 3, 0}, angular_velocity = {0, 0, 5} },\n"
          "sim.rigid { shape = sim.box { half = {0.3, 0.2, 0.1} }, mass = 1, position = {0, 0, "
          "-2}, velocity = {0, 0, 3}, angular_velocity = {0, 3, 5}, restitution = 0.3 } }",
      "particles = p, bodies = b", false);
  TextRun scene(text, "verlet", 0.002);
  const Momentum start = momentum_of(scene.system, 0.1);
  double energy = scene.system.energy().kinetic;
  for (int n = 0; n < 1000; ++n) {
    REQUIRE(scene.system.step());
    const double now = scene.system.energy().kinetic;
    CHECK(now < energy * (1 + 1e-4));
    energy = now;
  }
  CHECK(scene.system.contact_work().lost > 5);
  const Momentum end = momentum_of(scene.system, 0.1);
  CHECK((end.linear - start.linear).norm() < 1e-12);
  CHECK((end.angular - start.angular).norm() < 5e-3);
}

TEST_CASE("a particle and a body hit each other as Newton says", "[rigid]") {
  for (const char* shape : {"sim.sphere { radius = 0.2 }", "sim.box { half = {0.2, 0.3, 0.3} }",
                            "cube(0.2)", "sim.capsule { radius = 0.2, length = 0.4 }"}) {
    INFO(shape);
    TextRun scene(scene_of(std::string(kCube) +
                               "local p = sim.particles { mass = 0.5 }\np:add({-1, 0, 0}, { "
                               "velocity = {4, 0, 0} })\nlocal b = sim.rigid { shape = " +
                               shape + ", mass = 1.5, restitution = 0.6 }",
                           "particles = p, bodies = { b }", false),
                  "verlet", 0.01);
    scene.run_to(1);
    // u = (m1 v1 +- e m v1) / (m1 + m2)
    CHECK(scene.system.velocity(0).x() == Approx(4 * (0.5 - 0.6 * 1.5) / 2).margin(1e-9));
    CHECK(scene.system.body_state(0).velocity.x() == Approx(4 * 0.5 * 1.6 / 2).margin(1e-9));
    CHECK(scene.system.position(0).x() == Approx(-0.2 - 0.8 * 0.8).margin(1e-9));
  }
}

TEST_CASE("a box falls on a net that holds it", "[rigid]") {
  const std::string text =
      "local net = sim.grid { 9, 9, origin = {-0.4, 0, -0.4}, du = {0.1, 0, 0}, dv = {0, 0, 0.1}, "
      "mass = 0.01 }\n"
      "for i = 0, 8 do net:pin(net:id(0, i)); net:pin(net:id(8, i)) end\n"
      "local box = sim.rigid { shape = sim.box { half = {0.16, 0.05, 0.16} }, mass = 0.3, "
      "position = {0, 0.2, 0}, friction = 0.5 }\n"
      "return sim.scene { particles = net, bodies = { box }, forces = { sim.force.gravity {}, "
      "sim.force.spring { stiffness = 300, damping = 0.5, grid = net, offsets = { {1,0}, {0,1}, "
      "{1,1}, {1,-1} } } }, integrator = 'verlet', dt = 0.001, duration = 3 }\n";
  TextRun scene(text, "verlet", 0.001);
  const double before = scene.system.energy().total();
  scene.run_to(3);
  const RigidState state = scene.system.body_state(0);
  // It swings by now about where it will lie.
  CHECK(state.center.y() == Approx(-0.0446).margin(0.005));
  CHECK(state.velocity.norm() < 0.15);
  CHECK(std::fabs(state.center.x()) + std::fabs(state.center.z()) < 1e-6);  // symmetry
  CHECK(scene.system.energy().total() < before);
  // Nothing of the net is in the box.
  for (int i = 0; i < 81; ++i) {
    const Vec3 d = scene.system.position(i) - state.center;
    double out = -1;
    for (std::size_t k = 0; k < 3; ++k)
      out = std::max(out, std::fabs(state.axes.column(k).dot(d)) - (k == 1 ? 0.05 : 0.16));
    CHECK(out > -1e-9);
  }
  const std::size_t taken = sim_test::allocation_count();
  for (int n = 0; n < 10; ++n) REQUIRE(scene.system.step());
  CHECK(sim_test::allocation_count() == taken);

  // The same bits on two threads, and back in time.
  TextRun one(text, "verlet", 0.001), two(text, "verlet", 0.001, 2);
  one.run_to(0.4);
  two.run_to(0.3);
  const Snapshot middle = two.system.snapshot();
  two.run_to(0.4);
  CHECK(one.system.hash() == two.system.hash());
  two.system.restore(middle);
  two.run_to(0.4);
  CHECK(one.system.hash() == two.system.hash());
}

TEST_CASE("what is pushed onto a collider stays outside of it", "[rigid]") {
  TextRun scene(scene_of("local p = sim.particles { mass = 0.1 }\nfor i = -1, 1 do for j = -1, 1 "
                         "do p:add { 0.2 * i, 0, 0.2 * j } end end\nlocal b = sim.rigid { shape = "
                         "sim.box { half = {0.3, 0.1, 0.3} }, mass = 5, position = {0, 0.5, 0} }",
                         "particles = p, bodies = { b }, colliders = { sim.collider.plane {} }"),
                "verlet", 0.005);
  scene.run_to(2);
  CHECK(scene.system.body_state(0).center.y() == Approx(0.1).margin(1e-9));
  CHECK(scene.system.body_state(0).velocity.norm() < 1e-9);
  for (int i = 0; i < 9; ++i) CHECK(std::fabs(scene.system.position(i).y()) < 1e-9);
}

// It turns by 0.9 rad a step, and is on neither end of a step where the post is.
TEST_CASE("a rod that turns fast hits a post that it is past at the end of the step", "[rigid]") {
  TextRun scene(scene_of("local rod = sim.rigid { shape = sim.capsule { radius = 0.01, length = 1 "
                         "}, mass = 1, angular_velocity = {0, 0, 90}, rotation = {0, 0, 0.5} }",
                         "bodies = { rod }, colliders = { sim.collider.sphere { center = {0.4 * "
                         "math.cos(0.95), 0.4 * math.sin(0.95), 0}, radius = 0.02 } }",
                         false),
                "verlet", 0.01);
  scene.run_to(0.05);
  CHECK(scene.system.body_state(0).angular_velocity.z() < 60);
}

TEST_CASE("what does not touch goes through", "[rigid]") {
  const auto far = [](const std::string& more) {
    TextRun scene(scene_of("local p = sim.particles { mass = 1 }\np:add({-1, 0, 0}, { velocity = "
                           "{2, 0, 0} })\nlocal b = sim.rigid { shape = sim.sphere { radius = 0.2 "
                           "}, mass = 1" +
                               more + " }",
                           "particles = p, bodies = { b }", false),
                  "verlet", 0.01);
    scene.run_to(1);
    return scene.system.position(0).x();
  };
  CHECK(far(", touches = false") == Approx(1));
  CHECK(far(", touches = true") == Approx(0.4));
  // A particle that a spring ties to the body may be in it.
  TextRun tied(
      "local p = sim.particles { mass = 1 }\np:add {0, 0.1, 0}\np:pin(0)\nlocal b = "
      "sim.rigid { shape = sim.sphere { radius = 0.2 }, mass = 1 }\nreturn sim.scene { "
      "particles = p, bodies = { b }, forces = { sim.force.spring { stiffness = 1, rest = "
      "0 }:tie(0, b:at {0, 0, 0}) }, integrator = 'dopri5', dt = 0.01, duration = 1 }\n",
      "dopri5", 0.01);
  CHECK(tied.system.corrections().empty());
}

TEST_CASE("what bodies cannot touch, and what is inside, is refused by name", "[rigid]") {
  const auto why = [](const std::string& text) {
    const auto error = text_error(text);
    REQUIRE(error);
    return error->text().why + "; " + error->text().remedy;
  };
  const std::string ball = "sim.rigid { shape = sim.sphere { radius = 1 }, mass = 1 }";
  // A dart: its fifth point is pushed in.
  const std::string dart =
      "sim.rigid { mass = 1, position = {9, 9, 9}, shape = sim.mesh { points = { {0,0,0}, {1,0,0}, "
      "{0,1,0}, {0,0,1}, {0.2,0.2,0.2} }, triangles = { {0,2,1}, {0,1,3}, {0,3,2}, {1,2,4}, "
      "{2,3,4}, {3,1,4} } } }";
  CHECK(contains(why(scene_of("", "bodies = { " + ball + ", " + dart + " }")),
                 "body 1 (mesh) is not convex"));
  CHECK(contains(why(scene_of("", "bodies = { " + dart +
                                      " }, colliders = { sim.collider.sphere { radius = 1 } }")),
                 "body 0 (mesh) is not convex"));
  CHECK(contains(why(scene_of("local p = sim.particles {}\np:add {5, 5, 5}\np:add {0, 0.25, 0}",
                              "particles = p, bodies = { " + ball + " }")),
                 "body 0 (sphere) and particle 1 overlap by 0.75 m at the start"));
  CHECK(contains(why(scene_of("",
                              "bodies = { sim.rigid { shape = sim.box { half = {1, 1, 1} }, "
                              "mass = 1 } }, colliders = { sim.collider.sphere { radius = 1, "
                              "center = {1.5, 0, 0} } }")),
                 "body 0 (box) is 0.5 m inside a collider"));
  CHECK(contains(why(scene_of("",
                              "bodies = { sim.rigid { shape = sim.sphere { radius = 1 }, mass "
                              "= 1, touches = 3 } }")),
                 "true or false"));
}
