// Rest of what lies on something: particles and rods on colliders, boxes, bodies on cloth.
#include <cmath>

#include "core/output/format.h"
#include "core/study/rest.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kG = 9.81;

std::string end_of(const std::string& parts) {
  return "return sim.scene { particles = particles, " + parts +
         ", integrator = \"verlet\", dt = 0.002, duration = 1 }\n";
}

}  // namespace

TEST_CASE("a bead on a spring comes to rest on the floor", "[rest]") {
  // The spring bears a half of it, the floor the other half.
  TextRun run(
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add {0, 2, 0}\n"
      "particles:add {0.3, 1, 0}\n"
      "particles:pin(0)\n"
      "local spring = sim.force.spring { stiffness = 9.81, rest = 1.5, ties = { {0, 1} } }\n" +
          end_of("forces = { sim.force.gravity {}, spring },\n"
                 "colliders = { sim.collider.plane { point = {0, 0, 0}, normal = {0, 1, 0} } }"),
      "verlet", 2e-3);
  const study::Rest rest = study::come_to_rest(run.system);
  CHECK(rest.found);
  CHECK(rest.force <= 1e-6 * kG);
  CHECK(rest.effort.steps < 1000);  // 1701 of its own length
  CHECK(run.system.position(1).y() == Approx(0).margin(1e-9));
  CHECK(run.system.position(1).x() == Approx(0).margin(1e-6));
  CHECK(run.system.velocity(1) == Vec3::Zero());
  CHECK(run.system.t() == 0);
}

// A particle hangs on a soft spring until a cable of 1e4 times its stiffness catches it.
// m g = k (y0 - y) + K (-1 - y).
TEST_CASE("rest is searched with steps near their limit, and with those that hold where it falls",
          "[rest]") {
  const auto rest_with = [](double dt, int& steps) {
    TextRun run(
        "local particles = sim.particles { mass = 1 }\n"
        "particles:add {0, 0, 0}\n"
        "particles:add {0, -0.5, 0}\n"
        "particles:pin(0)\n"
        "local spring = sim.force.spring { stiffness = 1, rest = 0.5, ties = { {0, 1} } }\n"
        "local cable = sim.force.spring { family = \"cable\", stiffness = 1e4, rest = 1,\n"
        "  tension_only = true, ties = { {0, 1} } }\n" +
            end_of("forces = { sim.force.gravity {}, spring, cable },\n"
                   "colliders = { sim.collider.plane { point = {0, -5, 0}, normal = {0, 1, 0} } }"),
        "verlet", dt);
    const study::Rest rest = study::come_to_rest(run.system);
    INFO(dt << " s: " << rest.why << ", " << rest.force << " N of " << rest.in_play);
    CHECK(rest.found);
    CHECK(run.system.position(1).y() ==
          Approx(-(kG + 0.5 + 1e4) / (1 + 1e4)).margin(2e-6 * kG / 1e4));
    CHECK(run.system.h() == dt);
    CHECK(run.system.t() == 0);
    CHECK(run.system.step_count() == 0);
    steps = static_cast<int>(rest.effort.steps);
  };
  // The limits are 2 s and 0.02 s: the last two steps diverge where the cable is tight.
  int steps[4];
  const double dts[4] = {2e-4, 2e-3, 2.5e-2, 0.5};
  for (int i = 0; i < 4; ++i) rest_with(dts[i], steps[i]);
  CHECK(steps[0] > 3 * steps[1]);
}

// From 5 um above the floor it lands within a step of 2 ms, after which it has no velocity.
TEST_CASE("what hangs in the air above a floor is not at rest", "[rest]") {
  for (const double height : {5e-6, 1e-9}) {
    TextRun run(
        "local particles = sim.particles { mass = 1 }\n"
        "particles:add {0, " +
            shortest(height) +
            ", 0}\n"
            "particles:add {1, 0, 0}\n" +
            end_of("forces = { sim.force.gravity {} },\n"
                   "colliders = { sim.collider.plane { normal = {0, 1, 0} } }"),
        "verlet", 2e-3);
    const study::Rest rest = study::come_to_rest(run.system);
    CHECK(rest.found);
    CHECK(std::abs(run.system.position(0).y()) < 1e-11);
    CHECK(rest.effort.steps < 100);
  }
}

TEST_CASE("a chain of rods comes to rest on a floor", "[rest]") {
  // It hangs from 0.5 m above; the rest of it lies on the floor.
  TextRun run(
      "local particles = sim.particles { mass = 0.1 }\n"
      "for k = 0, 10 do particles:add {0.1 * k, 0.5, 0} end\n"
      "particles:pin(0)\n"
      "local rods = sim.constraint.distance {}\n"
      "for k = 0, 9 do rods:tie(k, k + 1) end\n" +
          end_of("forces = { sim.force.gravity {} }, constraints = { rods },\n"
                 "colliders = { sim.collider.plane { point = {0, 0, 0}, normal = {0, 1, 0},\n"
                 "  friction = 0.5 } }"),
      "verlet", 2e-3);
  const study::Rest rest = study::come_to_rest(run.system);
  INFO(rest.why << ", " << rest.force << " N of " << rest.in_play);
  CHECK(rest.found);
  double lowest = 1, longest = 0;
  for (int k = 1; k <= 10; ++k) {
    lowest = std::min(lowest, run.system.position(k).y());
    longest = std::max(longest, (run.system.position(k) - run.system.position(k - 1)).norm());
  }
  CHECK(lowest == Approx(0).margin(1e-9));
  CHECK(longest == Approx(0.1).epsilon(1e-12));
  CHECK(run.system.position(10).y() == Approx(0).margin(1e-9));
  // A scene left at rest stays so, but for the slip that its friction leaves.
  CHECK(rest.force <= 1e-3 * rest.in_play);
  const Vec3 before = run.system.position(7);
  run.run_to(0.5);
  CHECK((run.system.position(7) - before).norm() < 1e-4);
}

TEST_CASE("a box comes to rest on a floor", "[rest]") {
  TextRun run(
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add {5, 0, 0}\n"
      "particles:pin(0)\n"
      "local box = sim.rigid { shape = sim.box { half = {0.1, 0.05, 0.1} }, mass = 2,\n"
      "  position = {0, 0.2, 0}, rotation = {0.2, 0, 0.1}, friction = 0.5 }\n" +
          end_of("forces = { sim.force.gravity {} }, bodies = { box },\n"
                 "colliders = { sim.collider.plane { point = {0, 0, 0}, normal = {0, 1, 0},\n"
                 "  friction = 0.5 } }"),
      "verlet", 1e-3);
  const study::Rest rest = study::come_to_rest(run.system);
  INFO(rest.why << ", " << rest.force << " N of " << rest.in_play);
  CHECK(rest.found);
  CHECK(run.system.body_state(0).center.y() == Approx(0.05).margin(1e-4));
}

TEST_CASE("a search for rest on contact ends soon and says why", "[rest]") {
  // A ball on a slope without friction slides away.
  TextRun run(
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add {0, 0.1, 0}\n" +
          end_of("forces = { sim.force.gravity {} },\n"
                 "colliders = { sim.collider.plane { point = {0, 0, 0}, normal = {1, 1, 0} } }"),
      "verlet", 2e-3);
  const study::Rest rest = study::come_to_rest(run.system);
  CHECK_FALSE(rest.found);
  CHECK_FALSE(rest.why.empty());
  int asked = 0;
  const study::Rest stopped = study::come_to_rest(run.system, [&] { return ++asked > 5; });
  CHECK_FALSE(stopped.found);
  CHECK(stopped.why == "interrupted");
}

TEST_CASE("a search for rest that is ended within a step says so", "[rest]") {
  // Jacobians, iterations and contact ask, too.
  for (const char* const method : {"verlet", "implicit_midpoint"}) {
    TextRun run(
        "local particles = sim.particles { mass = 0.1 }\n"
        "for k = 0, 10 do particles:add {0.1 * k, 0.5, 0} end\nparticles:pin(0)\n"
        "local spring = sim.force.spring { stiffness = 100 }\n"
        "for k = 0, 9 do spring:tie(k, k + 1) end\n" +
            end_of("forces = { sim.force.gravity {}, spring },\n"
                   "colliders = { sim.collider.plane { friction = 0.5 } }"),
        method, 2e-3);
    for (int most = 1; most < 40; ++most) {
      int asked = 0;
      const study::Rest rest = study::come_to_rest(run.system, [&] { return ++asked > most; });
      INFO(method << ", asked " << most << " times");
      CHECK((rest.found || rest.why == "interrupted"));
    }
  }
}

TEST_CASE("springs that would bear too much at rest break on the way to it", "[rest]") {
  // Two springs side by side bear half the weight each, one of them not so much.
  const auto hanging = [](const std::string& limit) {
    return "local particles = sim.particles { mass = 1 }\n"
           "particles:add {0, 0, 0}\n"
           "particles:add {0, -1, 0}\n"
           "particles:pin(0)\n"
           "local spring = sim.force.spring { stiffness = 100, rest = 1, ties = { {0, 1},\n"
           "  {0, 1, break_force = " +
           limit + "} } }\n" + end_of("forces = { sim.force.gravity {}, spring }");
  };
  TextRun weak(hanging("4"), "verlet", 2e-3);
  const study::Rest rest = study::come_to_rest(weak.system);
  CHECK(rest.found);
  CHECK(rest.broke == 1);
  CHECK(weak.system.settings().broken == std::vector<int>{1});
  CHECK(weak.system.position(1).y() == Approx(-1 - kG / 100).margin(1e-6));
  TextRun strong(hanging("5"), "verlet", 2e-3);
  const study::Rest whole = study::come_to_rest(strong.system);
  CHECK(whole.found);
  CHECK(whole.broke == 0);
  CHECK(strong.system.position(1).y() == Approx(-1 - kG / 200).margin(1e-9));
}

TEST_CASE("rods that bear less than what hangs on them break on the way to rest", "[rest]") {
  // Rod k of 5, from above, bears 5 - k beads of 1 kg; nothing holds what falls.
  TextRun run(
      "local particles = sim.particles { mass = 1 }\n"
      "for k = 0, 5 do particles:add {0, -k, 0} end\n"
      "particles:pin(0)\n"
      "local rods = sim.constraint.distance { break_force = 45 }\n"
      "for k = 0, 4 do rods:tie(k, k + 1) end\n" +
          end_of("forces = { sim.force.gravity {} }, constraints = { rods }"),
      "verlet", 2e-3);
  const study::Rest rest = study::come_to_rest(run.system);
  CHECK_FALSE(rest.found);
  CHECK(rest.why == "particle 1 moves away without end, along (0, -1, 0), and 4 more with it");
}

TEST_CASE("beside a collider that moves no rest is looked for", "[rest]") {
  TextRun run(
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add {0, 1, 0}\n" +
          end_of("forces = { sim.force.gravity {} },\n"
                 "colliders = { sim.collider.plane { normal = {0, 1, 0},\n"
                 "  motion = sim.motion.line { velocity = {0, 0.1, 0} } } }"),
      "verlet", 2e-3);
  try {
    study::come_to_rest(run.system);
    FAIL("it was found");
  } catch (const Error& error) {
    CHECK(error.kind() == ErrorKind::kUsage);
    CHECK(contains(error.text().why, "a collider moves"));
  }
}
