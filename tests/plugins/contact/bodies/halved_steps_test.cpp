// Steps in which bodies would pass through each other are taken in halves.
#include <algorithm>
#include <string>

#include "core/particles/step_correction.h"
#include "tests/lua/scene_text.h"
#include "tests/support/momentum.h"

using namespace sim;
using namespace sim::test;
using sim_test::Momentum;
using sim_test::momentum_of;

namespace {

const std::string kPlate =
    "local function plate(x, v) return sim.rigid { shape = sim.box { half = {0.002, 0.1, 0.1} }, "
    "mass = 0.1, position = {x, 0, 0}, velocity = {v or 0, 0, 0}, friction = 0.2 } end\n";

// A block hits the first of three plates of 4 mm, 5 cm behind each other, and drives them on. Far
// off a particle hits a floor.
std::string plates(double speed, double off_center) {
  return kPlate +
         "local block = sim.rigid { shape = sim.box { half = {0.05, 0.05, 0.05} }, mass = 10, "
         "friction = 0.2, position = {-0.1, " +
         std::to_string(off_center) + ", 0}, velocity = {" + std::to_string(speed) +
         ", 0, 0} }\n"
         "local p = sim.particles { mass = 0.01 }\n"
         "p:add({0, -8, 0}, { velocity = {0, -300, 0} })\n"
         "local floor = sim.collider.plane { point = {0, -8.5, 0}, normal = {0, 1, 0}, "
         "restitution = 0.5 }\n"
         "return sim.scene { particles = p, colliders = { floor }, bodies = { block, plate(0), "
         "plate(0.05), plate(0.1) }, forces = {}, "
         "integrator = 'verlet', dt = 0.01, duration = 0.05 }\n";
}

double along(const Simulation& system, int body) { return system.body_state(body).center.x(); }

bool says_halved(const Simulation& system) {
  return system.corrections()[0]->account().words.find(" halved") != std::string::npos;
}

}  // namespace

TEST_CASE("plates that a fast block strikes stay in their order, in long steps too",
          "[rigid][halved_steps]") {
  for (const char* method : {"verlet", "rk4", "symplectic_euler"})
    for (const double speed : {1.0, 5.0, 10.0, 40.0, 100.0})
      for (const double off_center : {0.0, 0.01}) {
        INFO(method << " at " << speed << " m/s, " << off_center << " m off the center");
        TextRun run(plates(speed, off_center), method, 0.01);
        const Momentum before = momentum_of(run.system);
        run.run_to(0.03);
        for (int i = 0; i < 3; ++i) CHECK(along(run.system, i) < along(run.system, i + 1));
        const Momentum after = momentum_of(run.system);
        CHECK((after.linear - before.linear).norm() < 1e-11 * before.linear.norm());
        CHECK(run.system.step_count() == 3);
        CHECK(run.system.t() == Approx(0.03));
        if (speed != 5) CHECK(says_halved(run.system) == (speed > 5));
      }
}

TEST_CASE("a step that is halved has the bits of its parts, and goes back as a whole",
          "[rigid][halved_steps]") {
  TextRun whole(plates(10, 0.01), "verlet", 0.01), parts(plates(10, 0.01), "verlet", 0.005);
  whole.run_to(0.01);
  parts.run_to(0.01);
  REQUIRE(says_halved(whole.system));
  REQUIRE_FALSE(says_halved(parts.system));
  CHECK(std::ranges::equal(whole.system.state(), parts.system.state()));
  CHECK(whole.system.contact_work().lost == parts.system.contact_work().lost);

  const Snapshot then = whole.system.snapshot();
  whole.run_to(0.03);
  const std::uint64_t end = whole.system.hash();
  whole.system.restore(then);
  whole.run_to(0.03);
  CHECK(whole.system.hash() == end);
  TextRun threads(plates(10, 0.01), "verlet", 0.01, 2);
  threads.run_to(0.03);
  CHECK(threads.system.hash() == end);
}

TEST_CASE("a halved step that is given up leaves all as it was", "[rigid][halved_steps]") {
  TextRun whole(plates(10, 0.01), "verlet", 0.01);
  REQUIRE(whole.system.step());
  const std::uint64_t end = whole.system.hash();
  int given_up = 0;
  for (int calls = 0;; ++calls) {
    TextRun run(plates(10, 0.01), "verlet", 0.01);
    const std::uint64_t start = run.system.hash();
    int left = calls;
    run.system.stop_when([&left] { return left-- <= 0; });
    if (run.system.step()) break;
    ++given_up;
    INFO("after " << calls << " calls");
    REQUIRE(run.system.hash() == start);
    CHECK(run.system.contact_work().lost == 0);
    run.system.stop_when({});
    REQUIRE(run.system.step());
    REQUIRE(run.system.hash() == end);
  }
  CHECK(given_up > 2);
}

TEST_CASE("a thin plate hits a thin plate however fast it flies", "[rigid][halved_steps]") {
  for (const double speed : {1.0, 30.0, 100.0, 300.0, 1000.0}) {
    INFO(speed << " m/s");
    TextRun run(kPlate + "return sim.scene { bodies = { plate(-0.013, " + std::to_string(speed) +
                    "), plate(0, 0) }, forces = {}, integrator = 'verlet', dt = 0.01, duration = "
                    "0.05 }\n",
                "verlet", 0.01);
    run.run_to(0.02);
    for (int i = 0; i < 2; ++i)
      CHECK(run.system.body_state(i).velocity.x() == Approx(0.5 * speed).epsilon(1e-9));
    CHECK(along(run.system, 1) - along(run.system, 0) == Approx(0.004).epsilon(1e-6));
  }
}
