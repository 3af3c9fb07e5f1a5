// Rigid bodies that rest take no steps until something touches them.
#include <cmath>

#include "core/scene/scene_part.h"
#include "core/session/checkpoint.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;
using sim_test::same_bits;
using sim_test::state_of;

namespace {

constexpr int kHigh = 3;  // boxes of a stack

// Stacks of boxes 2 m apart along z on a floor, and a ball.
std::string stacks(int count, const std::string& ball, const std::string& sleep = "sleep = 1e-8") {
  return "local bodies = {}\nfor s = 0, " + std::to_string(count - 1) + " do for k = 0, " +
         std::to_string(kHigh - 1) +
         " do bodies[#bodies + 1] = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} }, "
         "mass = 1, position = {0, 0.1001 + 0.2001 * k, 2 * s}, friction = 0.5 } end end\n"
         "bodies[#bodies + 1] = sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 0.3, " +
         ball +
         " }\nreturn sim.scene { bodies = bodies, colliders = { sim.collider.plane { friction = "
         "0.5 "
         "} },\nforces = { sim.force.gravity { g = {0, -9.81, 0} } }, integrator = 'verlet', "
         "dt = 0.005, duration = 2, " +
         sleep + " }\n";
}

// It comes along x, and is at the height at which it began when it meets the uppermost box.
const char* const kThrown = "position = {-6, 0.52, 0}, velocity = {3, 9.4725, 0}";
const char* const kDropped = "position = {0.02, 9.5, 0}";

double lowest_support(const Simulation& system, int stack) {
  double gap = HUGE_VAL;
  for (int k = 0; k < kHigh; ++k)
    gap = std::min(gap, system.body_state(kHigh * stack + k).center.y() - 0.1 - 0.2 * k);
  return gap;
}

}  // namespace

TEST_CASE("stacks of bodies fall asleep, and the one that a ball hits wakes as a whole",
          "[rigid][sleep]") {
  TextRun scene(stacks(4, kThrown), "verlet", 0.005);
  Simulation& system = scene.system;
  CHECK(system.sleep().islands == 4 * kHigh + 1);
  scene.run_to(0.9);
  CHECK(system.sleep().asleep == 4 * kHigh);
  const double before = system.body_state(kHigh - 1).center.x();
  int fewest = 4 * kHigh;
  while (system.t() < 6) {
    REQUIRE(system.step());
    fewest = std::min(fewest, system.sleep().asleep);
    for (int s = 0; s < 4; ++s)
      REQUIRE(lowest_support(system, s) > (s == 0 ? -0.2 * kHigh : -1e-8));
    for (int k = 0; k < kHigh; ++k)  // no body falls into the floor or into one below it
      REQUIRE(system.body_state(k).center.y() > 0.1 - 1e-6);
  }
  CHECK(fewest == 3 * kHigh);
  CHECK(std::fabs(system.body_state(kHigh - 1).center.x() - before) > 0.01);
  for (int s = 1; s < 4; ++s)
    for (int k = 0; k < kHigh; ++k)
      CHECK(system.body_state(kHigh * s + k).center.x() == Approx(0).margin(1e-9));
}

TEST_CASE("a body that lands on a sleeping stack finds all of it awake", "[rigid][sleep]") {
  // From above: the box at the bottom carries the others from the first step on.
  TextRun scene(stacks(1, kDropped), "verlet", 0.005);
  TextRun awake(stacks(1, kDropped, "sleep = nil"), "verlet", 0.005);
  scene.run_to(1);
  CHECK(scene.system.sleep().asleep == kHigh);
  bool woken = false;
  while (scene.system.t() < 1.6) {
    REQUIRE(scene.system.step());
    woken = woken || scene.system.sleep().asleep == 0;
    REQUIRE(lowest_support(scene.system, 0) > -1e-6);
  }
  CHECK(woken);
  awake.run_to(1.6);
  for (int body = 0; body <= kHigh; ++body)
    CHECK((scene.system.body_state(body).center - awake.system.body_state(body).center).norm() <
          1e-5);
}

TEST_CASE("sleeping bodies go on from checkpoints and on threads with the same bits",
          "[rigid][sleep]") {
  TextRun whole(stacks(3, kThrown), "verlet", 0.005), other(stacks(3, kThrown), "verlet", 0.005, 3);
  for (const double at : {0.5, 1.4, 2.6}) {
    whole.run_to(at);
    sim::resume(other.system, other.spec.systems[0],
                sim::checkpoint(whole.system, whole.spec.systems[0], 0), other.registry);
    CHECK(other.system.sleep().asleep == whole.system.sleep().asleep);
    whole.run_to(at + 0.6);
    other.run_to(at + 0.6);
    CHECK(same_bits(state_of(whole.system), state_of(other.system)));
    CHECK(other.system.sleep().taken == whole.system.sleep().taken);
  }
}

TEST_CASE("a collider that moves wakes the bodies that it reaches, by their size",
          "[rigid][sleep]") {
  // A wall at x = 0.7 sin(2 pi t / 4 s) - 0.5 m reaches the face of the box, at -0.1 m, at 0.39 s.
  TextRun scene(
      "local box = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} }, mass = 1, "
      "position = {0, 0.1, 0} }\n"
      "local far = sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 1, "
      "position = {5, 0.1, 0} }\n"
      "local wall = sim.collider.plane { normal = {1, 0, 0}, point = {-0.5, 0, 0},\n"
      "  motion = sim.motion.swing { amplitude = {0.7, 0, 0}, period = 4 } }\n"
      "return sim.scene { bodies = { box, far }, colliders = { wall, "
      "sim.collider.plane {} }, forces = { sim.force.gravity { g = {0, -9.81, 0} } },\n"
      "  integrator = 'verlet', dt = 0.002, duration = 1, "
      "sleep = { energy = 1e-6, after = 0.1 } }\n",
      "verlet", 0.002);
  scene.run_to(0.2);
  CHECK(scene.system.sleep().asleep == 2);
  while (scene.system.t() < 0.6) {
    REQUIRE(scene.system.step());
    const double wall = -0.5 + 0.7 * std::sin(M_PI / 2 * scene.system.t());
    REQUIRE(scene.system.body_state(0).center.x() > wall + 0.1 - 1e-6);
  }
  CHECK(scene.system.sleep().asleep == 1);
  CHECK(scene.system.body_state(1).center.x() == 5);
}

TEST_CASE("bodies that rods and joints hold are an island with what holds them", "[rigid][sleep]") {
  const std::string text =
      "local p = sim.particles { mass = 0.1 }\nlocal rods = sim.constraint.distance {}\n"
      "local planks = {}\n"
      "for s = 0, 1 do\n"
      "  planks[#planks + 1] = sim.rigid { shape = sim.box { half = {0.5, 0.02, 0.15} }, mass = "
      "1,\n"
      "    position = {0, 0, 3 * s}, velocity = {0, 0, 0.5 * s} }\n"
      "  for _, x in ipairs {-0.45, 0.45} do for _, z in ipairs {-0.12, 0.12} do\n"
      "    local hook = p:add { x, 1.02, 3 * s + z }\n    p:pin(hook)\n"
      "    rods:tie(hook, planks[#planks]:at {x, 0.02, z})\n  end end\nend\n"
      "return sim.scene { particles = p, bodies = planks, constraints = { rods },\n"
      "  forces = { sim.force.gravity { g = {0, -9.81, 0} } }, integrator = 'verlet', dt = 0.005,\n"
      "  duration = 2, sleep = { energy = 1e-6, after = 0.1 } }\n";
  TextRun scene(text, "verlet", 0.005);
  CHECK(scene.system.sleep().islands == 2);
  scene.run_to(1);
  CHECK(scene.system.sleep().asleep == 1);
  CHECK(scene.system.body_state(0).center.norm() < 1e-9);
  // The other swings as it would alone.
  const SystemSpec& whole = scene.spec.systems[0];
  std::vector<int> ids{4, 5, 6, 7, 12, 13, 14, 15};
  const SystemSpec part = scene_part(whole, ids);
  REQUIRE(part.bodies.size() == 1);
  CHECK(part.bodies[0].first == 4);
  REQUIRE(part.points.size() == 4);
  CHECK(part.points[0].body == 0);
  CHECK(part.points[3].at == whole.points[7].at);
  REQUIRE(part.constraints.size() == 1);
  CHECK(part.constraints[0].elements.ids == std::vector<int>{0, 8, 1, 9, 2, 10, 3, 11});
  Registry registry{{SIM_PLUGIN_DIR}};
  Simulation alone(part, registry, {.integrator = "verlet", .dt = 0.005});
  while (alone.t() < 1 - 1e-9) REQUIRE(alone.step());
  CHECK((alone.body_state(0).center - scene.system.body_state(1).center).norm() < 1e-9);
}
