// Bodies that constraints join and that touch things: impulses run through rods and joints.
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/layout.h"
#include "core/particles/constraints/constraint_system.h"
#include "core/particles/step_correction.h"
#include "tests/lua/scene_text.h"
#include "tests/support/momentum.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;
using sim_test::Momentum;
using sim_test::momentum_of;

namespace {

// A plank of 1 kg that hangs by four ropes of so many rods each, a box above its middle, a ball
// beside it, a floor.
std::string plank(double mass, int links, const std::string& more = "") {
  return "local p = sim.particles { mass = 0.01 }\n"
         "local rods = sim.constraint.distance {}\n"
         "local plank = sim.rigid { shape = sim.box { half = {0.5, 0.02, 0.15} }, mass = 1, "
         "friction = 0.5 }\n"
         "local links = " +
         std::to_string(links) +
         "\n"
         "for _, x in ipairs {-0.45, 0.45} do for _, z in ipairs {-0.12, 0.12} do\n"
         "  local before = p:add { x, 1.02, z }\n  p:pin(before)\n"
         "  for l = 1, links - 1 do\n    local bead = p:add { x, 1.02 - l / links, z }\n"
         "    rods:tie(before, bead)\n    before = bead\n  end\n"
         "  rods:tie(before, plank:at {x, 0.02, z})\nend end\n"
         "local box = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} }, mass = " +
         std::to_string(mass) +
         ", friction = 0.5, position = {0, 0.2, 0} }\n"
         "local ball = sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 0.5, position = "
         "{0.9, 0, 0} }\n"
         "return sim.scene { particles = p, bodies = { plank, box, ball }, constraints = { rods }, "
         "colliders = { sim.collider.plane { point = {0, -1, 0}, friction = 0.5 } }, forces = { "
         "sim.force.gravity { g = {0, -9.81, 0} }" +
         more + " }, integrator = 'verlet', dt = 0.005, duration = 2 }\n";
}

ConstraintDrift drift_of(const Simulation& system) {
  return system.constraint_system()->drift(system.t(), system.state().data());
}

}  // namespace

TEST_CASE("a box comes to rest on a plank that hangs by rods above a floor", "[rigid]") {
  for (const char* const method : {"verlet", "rk4"})
    for (const double mass : {0.2, 1.0, 20.0}) {
      INFO(method << " " << mass);
      TextRun scene(plank(mass, 1), method, 0.005);
      scene.run_to(1.5);
      const RigidState plank = scene.system.body_state(0), box = scene.system.body_state(1),
                       ball = scene.system.body_state(2);
      CHECK(plank.center.norm() < 1e-9);
      CHECK(box.center.y() == Approx(0.12).margin(1e-9));
      CHECK((box.center - Vec3(0, 0.12, 0)).norm() < 1e-3);  // friction let it be there
      CHECK(box.velocity.norm() + plank.velocity.norm() < 1e-8);
      CHECK(ball.center.y() == Approx(-0.9).margin(1e-9));
      CHECK(drift_of(scene.system).position < 1e-12);
      CHECK(drift_of(scene.system).velocity < 1e-12);
    }
}

TEST_CASE("ropes of many rods carry plank and box, and touch the floor themselves", "[rigid]") {
  TextRun scene(plank(0.5, 5, ", sim.force.drag { k = 0.05 }"), "verlet", 0.002);
  scene.run_to(3);
  const RigidState plank = scene.system.body_state(0), box = scene.system.body_state(1);
  CHECK(std::fabs(plank.center.y()) < 0.02);
  CHECK(box.center.y() - plank.center.y() == Approx(0.12).margin(1e-3));
  CHECK(drift_of(scene.system).position < 1e-12);
}

// A ball hits the first of two that a rod joins, along it.
TEST_CASE("a blow runs through a rod and a joint", "[rigid]") {
  for (const double e : {0.0, 0.5, 1.0})
    for (const bool joint : {false, true}) {
      const std::string ball =
          "sim.rigid { shape = sim.sphere { radius = 0.1 }, restitution = " + std::to_string(e);
      const std::string link = joint ? "sim.constraint.joint {}:tie(a:at {0.15, 0, 0}, b:at "
                                       "{-0.15, 0, 0})"
                                     : "sim.constraint.distance { ties = { {a:at {0, 0, 0}, b:at "
                                       "{0, 0, 0}} } }";
      TextRun scene("local a = " + ball + ", mass = 1 }\nlocal b = " + ball +
                        ", mass = 3, position = {0.3, 0, 0} }\nlocal c = " + ball +
                        ", mass = 2, position = {-0.51, 0, 0}, velocity = {1, 0, 0} }\nreturn "
                        "sim.scene { bodies = { a, b, c }, forces = {}, constraints = { " +
                        link + " }, integrator = 'verlet', dt = 0.01, duration = 1 }\n",
                    "verlet", 0.01);
      INFO("e " << e << " joint " << joint);
      const Momentum before = momentum_of(scene.system);
      scene.run_to(0.6);
      // Newton's law of 2 kg on 4 kg.
      const double both = 2.0 / 6 * (1 + e), own = both - e;
      CHECK(scene.system.body_state(0).velocity.x() == Approx(both).margin(1e-9));
      CHECK(scene.system.body_state(1).velocity.x() == Approx(both).margin(1e-9));
      CHECK(scene.system.body_state(2).velocity.x() == Approx(own).margin(1e-9));
      const Momentum after = momentum_of(scene.system);
      CHECK((after.linear - before.linear).norm() < 1e-12);
      CHECK(drift_of(scene.system).position < 1e-12);
    }
}

TEST_CASE("bodies that a joint joins pass through each other, others do not", "[rigid]") {
  // Three boxes in a chain that is folded: the first and the third touch.
  TextRun scene(
      "local function box(x, y, w) return sim.rigid { shape = sim.box { half = {0.5, 0.1, 0.1} }, "
      "mass = 1, position = {x, y, 0}, angular_velocity = {0, 0, w} } end\n"
      "local a, b, c = box(0, 0, 0), box(1, 0, 2), box(2, 0, 6)\n"
      "return sim.scene { bodies = { a, b, c }, forces = {}, constraints = { "
      "sim.constraint.joint {}:tie(a:at {0.5, 0, 0}, b:at {-0.5, 0, 0}):tie(b:at {0.5, 0, 0}, c:at "
      "{-0.5, 0, 0}) }, integrator = 'verlet', dt = 0.002, duration = 1 }\n",
      "verlet", 0.002);
  const Momentum before = momentum_of(scene.system);
  double most = 0;
  while (scene.system.t() < 3) {
    REQUIRE(scene.system.step());
    most = std::max(most, drift_of(scene.system).position);
  }
  CHECK(sim_test::figure_of(scene.system, "points") > 0);
  CHECK(most < 1e-12);
  const Momentum after = momentum_of(scene.system);
  CHECK((after.linear - before.linear).norm() < 1e-12);
}

namespace {

// Dolls of a trunk and two legs, each an island of its own on the ground, which they reach by and
// by.
std::string dolls(int count) {
  return "local bodies, joint = {}, sim.constraint.joint {}\n"
         "local function limb(shape, x, y, z)\n"
         "  local b = sim.rigid { shape = shape, mass = 1, friction = 0.5, position = {x, y, z} }\n"
         "  bodies[#bodies + 1] = b\n  return b\nend\n"
         "for k = 0, " +
         std::to_string(count - 1) +
         " do\n"
         "  local y = 0.02 * k\n"
         "  local trunk = limb(sim.box { half = {0.2, 0.3, 0.1} }, k, 1.1 + y, 0)\n"
         "  for _, side in ipairs { -0.15, 0.15 } do\n"
         "    local leg = limb(sim.capsule { radius = 0.08, length = 0.5 }, k + side, 0.4 + y, 0)\n"
         "    joint:tie(trunk:at {side, -0.35, -0.02}, leg:at {0, 0.35, -0.02})\n"
         "    joint:tie(trunk:at {side, -0.35, 0.02}, leg:at {0, 0.35, 0.02})\n"
         "  end\nend\n"
         "return sim.scene { bodies = bodies, constraints = { joint }, colliders = { "
         "sim.collider.plane { friction = 0.5 } }, forces = { sim.force.gravity {} }, integrator = "
         "'verlet', dt = 0.002, duration = 1 }\n";
}

}  // namespace

TEST_CASE("a jointed doll moves in company as it does alone", "[rigid]") {
  TextRun alone(dolls(1), "verlet", 0.002), many(dolls(4), "verlet", 0.002);
  alone.run_to(0.6);
  many.run_to(0.6);
  for (int body = 0; body < 3; ++body) {
    const RigidState one = alone.system.body_state(body), other = many.system.body_state(body);
    CHECK((one.center - other.center).norm() < 1e-9);
    CHECK((one.velocity - other.velocity).norm() < 1e-7);
  }
  CHECK(alone.system.body_state(0).center.y() < 1.05);  // it has come down
  CHECK(drift_of(many.system).position < 1e-12);
  CHECK(drift_of(many.system).velocity < 1e-12);
}

TEST_CASE("islands of joints have the same bits on any number of threads", "[rigid]") {
  std::uint64_t first = 0;
  for (const int threads : {1, 2, 3}) {
    TextRun scene(dolls(40), "verlet", 0.002, threads);
    scene.run_to(0.12);
    if (threads == 1) first = scene.system.hash();
    CHECK(scene.system.hash() == first);
  }
}

// While plank and box lie on it, a bead of a rope is held and let go, and then its upper end.
TEST_CASE("pins that come and go change what joints join", "[rigid]") {
  TextRun scene(plank(0.5, 2), "verlet", 0.002);
  scene.run_to(0.5);
  const int bead = 1;  // of the first rope
  scene.system.set_pinned(bead, true);
  scene.run_to(0.8);
  CHECK(drift_of(scene.system).position < 1e-12);
  scene.system.set_pinned(bead, false);
  scene.system.set_pinned(0, false);  // the rope's end: the plank hangs by three
  TextRun fresh(plank(0.5, 2), "verlet", 0.002);
  fresh.system.restore(scene.system.snapshot());
  scene.run_to(1.1);
  fresh.run_to(1.1);
  CHECK(scene.system.hash() == fresh.system.hash());
  CHECK(drift_of(scene.system).position < 1e-12);
  CHECK(drift_of(scene.system).velocity < 1e-12);
}

namespace {

// Two doors that two ball joints hinge: one of their six equations follows from the others.
const char* const kHinge =
    "local joints, doors = sim.constraint.joint {}, {}\n"
    "for k, y in ipairs { 0.2, -0.2 } do\n"
    "  doors[k] = sim.rigid { shape = sim.box { half = {0.1, 0.2, 0.1} }, mass = 1,\n"
    "    position = {0, y, 0} }\nend\n"
    "for _, z in ipairs { -0.02, 0.02 } do\n"
    "  joints:tie(doors[1]:at {0, -0.2, z}, doors[2]:at {0, 0.2, z})\nend\n"
    "return sim.scene { bodies = doors, constraints = { joints }, forces = {},\n"
    "  integrator = 'verlet', dt = 0.001, duration = 1 }\n";

struct Hinge {
  TextRun scene{kHinge, "verlet", 0.001};
  ConstraintSystem& constraints = *scene.system.constraint_system();
  Layout layout{scene.system.particles(), 6};
  std::vector<double> state{scene.system.state().begin(), scene.system.state().end()};

  // One body is pushed away, and its particles not alike.
  void push(double off, const Vec3& way) {
    const int first = scene.system.body(1).first();
    for (int k = 0; k < RigidBody::kParticles; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        layout.axes(state.data())[axis][first + k] += off * way[axis] * (1 + 0.3 * k);
  }
  void factorise(std::vector<double> at) {
    REQUIRE(constraints.project_positions(0, at.data(), false));
  }
  // Returns how far particles move, and whether the constraints are obeyed then.
  std::pair<double, double> mend() {
    const std::vector<double> before = state;
    REQUIRE(constraints.project_state(0, state.data(), true));
    double moved = 0;
    for (std::size_t k = layout.offset(0); k < layout.offset(3); ++k)
      moved = std::max(moved, std::fabs(state[k] - before[k]));
    return {moved, constraints.drift(0, state.data()).position};
  }
};

}  // namespace

// Off the constraints that equation does not quite follow from the others.
TEST_CASE("a hinge is mended from afar without moving bodies further than it is off", "[rigid]") {
  for (const double off : {1e-4, 0.01, 0.05})
    for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0, 0.6, 0.8), Vec3(0.48, 0.6, -0.64)}) {
      INFO(off << " along " << way.x() << " " << way.y());
      Hinge hinge;
      hinge.factorise(hinge.state);
      hinge.push(off, way);
      const auto [moved, left] = hinge.mend();
      CHECK(moved < 3 * off);
      CHECK(left < 1e-14);
    }
}

TEST_CASE("factors of another state do not end the mending of a hinge", "[rigid]") {
  Hinge hinge;
  std::vector<double> turned = hinge.state;
  const auto q = hinge.layout.axes(turned.data());
  for (int i = 0; i < hinge.scene.system.particles(); ++i)
    q[0][i] = -std::exchange(q[1][i], q[0][i]);
  hinge.factorise(turned);
  hinge.push(2e-11, Vec3(0.48, 0.6, -0.64));
  CHECK(hinge.mend().second < 1e-14);
}

// Its links are further apart than the joints allow.
TEST_CASE("a chain of bodies that does not fit is mended, however long, and falls flat",
          "[rigid]") {
  for (const int links : {3, 30, 200}) {
    INFO(links << " links");
    TextRun scene(
        "local bodies, joints = {}, sim.constraint.joint {}\n"
        "for i = 1, " +
            std::to_string(links) +
            " do\n"
            "  bodies[i] = sim.rigid { shape = sim.capsule { radius = 0.02, length = 0.1 }, mass = "
            "0.1, position = { 0.15 * i, 0.1 + 0.05 * math.sin(0.4 * i), 0 }, "
            "rotation = { 0, 0, 0.5 * math.pi } }\n"
            "  if i > 1 then joints:tie(bodies[i - 1]:at {0, -0.075, 0}, bodies[i]:at {0, 0.075, "
            "0}) end\nend\n"
            "return sim.scene { bodies = bodies, constraints = { joints }, forces = { "
            "sim.force.gravity {} }, colliders = { sim.collider.plane {} }, "
            "contact = sim.contact.bodies { tolerance = 1e-6 }, integrator = 'verlet', dt = 0.002, "
            "duration = 1 }\n",
        "verlet", 0.002);
    scene.run_to(0.5);
    CHECK(drift_of(scene.system).position < 1e-12);
    double off = 0, speed = 0;
    for (int i = 0; i < links; ++i) {
      off = std::max(off, std::fabs(scene.system.body_state(i).center.y() - 0.02));
      speed = std::max(speed, scene.system.body_state(i).velocity.norm());
    }
    CHECK(off < 1e-6);
    CHECK(speed < 1e-5);
  }
}

// Sweeps over points, each followed by a projection onto the joints, converge slowly here.
TEST_CASE("contact of a heap of hinges is solved to its tolerance", "[rigid]") {
  TextRun scene(
      "local bodies, joints = {}, sim.constraint.joint {}\n"
      "for i = 1, 12 do\n  local angle, pair = 0.9 * i, {}\n"
      "  for k, side in ipairs { -1, 1 } do\n"
      "    pair[k] = sim.rigid { shape = sim.box { half = {0.15, 0.03, 0.04} }, mass = 1,\n"
      "      position = { 0.2 * side * math.cos(angle), 0.1 * i, -0.2 * side * math.sin(angle) },\n"
      "      rotation = { 0, angle, 0 }, friction = 0.5 }\n"
      "    bodies[#bodies + 1] = pair[k]\n  end\n"
      "  for _, z in ipairs { -0.03, 0.03 } do\n"
      "    joints:tie(pair[1]:at {0.2, 0, z}, pair[2]:at {-0.2, 0, z})\n  end\nend\n"
      "return sim.scene { bodies = bodies, constraints = { joints },\n"
      "  forces = { sim.force.gravity {} }, colliders = { sim.collider.plane { friction = 0.5 } "
      "},\n"
      "  contact = sim.contact.bodies { tolerance = 1e-9 },\n"
      "  integrator = 'verlet', dt = 0.005, duration = 1 }\n",
      "verlet", 0.005);
  scene.run_to(1);
  CHECK(drift_of(scene.system).position < 1e-12);
  for (const auto& each : scene.system.corrections()) {
    const StepCorrection::Account account = each->account();
    INFO(account.words);
    CHECK(account.acted);
    CHECK(account.words.find("impulses between them") == std::string::npos);
  }
}
