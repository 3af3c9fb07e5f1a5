// Rigid bodies that touch: closed forms of Coulomb's and Newton's laws, and what has to stay.
#include <cmath>

#include "core/session/timeline.h"
#include "tests/lua/scene_text.h"
#include "tests/support/allocations.h"
#include "tests/support/bouncing_ball.h"
#include "tests/support/momentum.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;
using sim_test::Momentum;
using sim_test::momentum_of;

namespace {

const char* const kFloor = "sim.collider.plane { normal = {0, 1, 0}, friction = 0.5 }";

std::string scene_of(const std::string& bodies, const std::string& colliders, bool gravity = true,
                     const std::string& before = "") {
  return before + "return sim.scene { bodies = { " + bodies + " }, colliders = { " + colliders +
         " }, forces = { " + (gravity ? "sim.force.gravity { g = {0, -9.81, 0} }" : "") +
         " }, integrator = 'verlet', dt = 0.01, duration = 1 }\n";
}

std::string box_on_incline(double friction, double speed) {
  const std::string mu = std::to_string(friction), v = std::to_string(speed);
  return scene_of(
      "b", "sim.collider.plane { normal = n, friction = " + mu + " }", true,
      "local n, d = { -math.sin(0.4), math.cos(0.4), 0 }, { math.cos(0.4), math.sin(0.4), 0 }\n"
      "local b = sim.rigid { shape = sim.box { half = {0.3, 0.1, 0.2} }, mass = 2, rotation = {0, "
      "0, "
      "0.4}, position = { 0.1 * n[1], 0.1 * n[2], 0 }, friction = " +
          mu + ", velocity = { -" + v + " * d[1], -" + v + " * d[2], 0 } }\n");
}

double slid(const Simulation& system) {
  return -system.body_state(0).center.dot(Vec3(std::cos(0.4), std::sin(0.4), 0));
}

std::string stack(int n, const std::string& lean = "0") {
  return scene_of("table.unpack(b)", kFloor, true,
                  "local b = {}\nfor i = 1, " + std::to_string(n) +
                      " do b[i] = sim.rigid { shape = sim.box { half = {0.5, 0.5, 0.5} }, mass = "
                      "1, friction = 0.5, position = { " +
                      lean + " * i, i - 0.5, 0 } } end\n");
}

// Boxes of 0.2 m above each other, 0.05 m apart, each moved by `skew` from the one below.
std::string falling_stack(int n, const std::string& skew) {
  return scene_of(
      "table.unpack(b)", kFloor, true,
      "local b, s = {}, " + skew + "\nfor i = 1, " + std::to_string(n) +
          " do b[i] = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} }, mass = "
          "1, friction = 0.5, position = { s * i, 0.25 * i - 0.1, 0.5 * s * i } } end\n");
}

}  // namespace

TEST_CASE("a box on an incline rests or slides as friction says", "[rigid]") {
  for (const char* method : {"verlet", "rk4", "symplectic_euler"}) {
    TextRun rests(box_on_incline(0.5, 0), method, 0.01);
    rests.run_to(1);
    CHECK(std::fabs(slid(rests.system)) < 1e-12);
    if (std::string(method) == "symplectic_euler") continue;
    TextRun slides(box_on_incline(0.3, 0), method, 0.01);
    slides.run_to(1);
    CHECK(slid(slides.system) ==
          Approx(0.5 * 9.81 * (std::sin(0.4) - 0.3 * std::cos(0.4))).margin(1e-12));
    CHECK(slides.system.body_state(0).angular_velocity.norm() < 1e-12);
    // It comes to rest within a step, and then stays.
    TextRun stops(box_on_incline(0.5, 0.3), method, 0.01);
    stops.run_to(1.5);
    const double brakes = 9.81 * (0.5 * std::cos(0.4) - std::sin(0.4));
    CHECK(slid(stops.system) == Approx(0.09 / (2 * brakes)).margin(2e-6));
    CHECK(stops.system.body_state(0).velocity.norm() < 1e-12);
  }
}

TEST_CASE("a ball bounces as Newton says, exactly in uniform gravity", "[rigid]") {
  const std::string text = scene_of(
      "sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 2, position = {0, 1.1, 0}, "
      "restitution = 0.8 }",
      kFloor);
  const double fall = std::sqrt(2 / 9.81), after = 1 - fall;
  for (const char* method : {"verlet", "rk4"}) {
    TextRun scene(text, method, 0.01);
    scene.run_to(1);
    CHECK(scene.system.body_state(0).center.y() ==
          Approx(0.1 + 0.8 * 9.81 * fall * after - 0.5 * 9.81 * after * after).margin(1e-12));
    const Energy energy = scene.system.energy();
    CHECK(energy.total() + scene.system.contact_work().lost ==
          Approx(2 * 9.81 * 1.1).epsilon(1e-12));
  }
  // Once it is slow it lies still.
  TextRun scene(text, "verlet", 0.01);
  scene.run_to(10);
  CHECK(scene.system.body_state(0).center.y() == Approx(0.1).margin(1e-9));
}

// In steps of 0.25 s it moves by four of its radii, and bounces several times in each.
TEST_CASE("a ball bounces in steps of any length, until it rests", "[rigid]") {
  for (const double e : {0.5, 0.8}) {
    const std::string text = scene_of(
        "sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 2, position = {0, 1.1, 0}, "
        "restitution = " +
            std::to_string(e) + " }",
        kFloor);
    for (const char* const method : {"verlet", "rk4", "implicit_midpoint"})
      for (const double h : {0.25, 0.1, 0.02, 0.003}) {
        INFO(method << ", " << h << ", " << e);
        TextRun scene(text, method, h);
        double off = 0;
        while (scene.system.t() < 5) {
          REQUIRE(scene.system.step());
          off = std::max(off, std::fabs(scene.system.body_state(0).center.y() - 0.1 -
                                        sim_test::bouncing_height(1, scene.system.t(), e)));
        }
        CHECK(off < 1e-12);
        CHECK(scene.system.body_state(0).velocity.norm() < 1e-12);
      }
  }
}

// A ball that falls on an incline from rest slips at g sin(0.4) t when it hits; friction stops the
// slip there, which leaves 5/7 of the velocity along the surface, and weight goes on to act. So it
// must whatever part of the step is left after the impact.
TEST_CASE("friction at an impact stops the slip that is there, not that at the end of the step",
          "[rigid]") {
  constexpr double kRadius = 0.3, kHigh = 0.2, kEnd = 0.28;
  const double down = 9.81 * std::sin(0.4), onto = 9.81 * std::cos(0.4);
  const double hit = std::sqrt(2 * kHigh / onto), after = kEnd - hit;
  const double left = 5.0 / 7 * down * hit;
  const std::string ball = scene_of(
      "b", "sim.collider.plane { normal = n, friction = 0.5 }", true,
      "local n = { -math.sin(0.4), math.cos(0.4), 0 }\n"
      "local b = sim.rigid { shape = sim.sphere { radius = 0.3 }, mass = 2, friction = 0.5, "
      "restitution = 0.5, position = { 0.5 * n[1], 0.5 * n[2], 0 } }\n");
  for (const char* method : {"verlet", "rk4"})
    for (const double h : {0.01, 0.004, 0.00175}) {
      CAPTURE(method, h);
      TextRun run(ball, method, h);
      run.run_to(kEnd);
      const RigidState state = run.system.body_state(0);
      CHECK(
          slid(run.system) ==
          Approx(0.5 * down * hit * hit + left * after + 0.5 * down * after * after).margin(1e-9));
      const Vec3 along(-std::cos(0.4), -std::sin(0.4), 0);
      CHECK(state.velocity.dot(along) == Approx(left + down * after).margin(1e-9));
      CHECK(state.angular_velocity.norm() == Approx(left / kRadius).margin(1e-9));
    }
}

TEST_CASE("a ball that slides rolls in the end, at 5/7 of its velocity", "[rigid]") {
  TextRun scene(
      scene_of("sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 1, position = {0, "
               "0.1, 0}, velocity = {2, 0, 0}, friction = 0.5 }",
               kFloor),
      "verlet", 0.001);
  scene.run_to(1);
  const RigidState state = scene.system.body_state(0);
  CHECK(state.velocity.x() == Approx(10.0 / 7).epsilon(1e-9));
  CHECK(state.angular_velocity.z() == Approx(-100.0 / 7).epsilon(1e-9));
  CHECK(state.center.y() == Approx(0.1).margin(1e-9));
}

TEST_CASE("a stack of ten boxes stands for ten seconds", "[rigid]") {
  for (const char* lean : {"0", "0.05"}) {
    TextRun scene(stack(10, lean), "verlet", 0.005);
    std::vector<Vec3> start;
    for (int i = 0; i < 10; ++i) start.push_back(scene.system.body_state(i).center);
    scene.run_to(10);
    for (int i = 0; i < 10; ++i)
      CHECK((scene.system.body_state(i).center - start[static_cast<std::size_t>(i)]).norm() < 1e-6);
  }
}

// Boxes land on each other while those below rest already: their moves have to fit together, or
// those that separate bodies lift the stack in each step, and it never comes to rest.
TEST_CASE("boxes that fall onto each other come to rest, and are lifted by nothing", "[rigid]") {
  constexpr int kBoxes = 10;
  constexpr double kWeight = 9.81;
  for (const char* skew : {"0", "0.013"}) {
    INFO("skew " << skew);
    TextRun scene(falling_stack(kBoxes, skew), "verlet", 0.005);
    double least = HUGE_VAL, lifted = 0;
    for (int n = 0; n < 400; ++n) {
      REQUIRE(scene.system.step());
      const double energy = scene.system.energy().total();
      lifted = std::max(lifted, energy - least);
      least = std::min(least, energy);
    }
    CHECK(lifted < 1e-3);
    CHECK(scene.system.energy().kinetic < 1e-20);
    for (int i = 0; i < kBoxes; ++i)
      CHECK(scene.system.body_state(i).center.y() == Approx(0.1 + 0.2 * i).margin(1e-6));
    CHECK(least == Approx(kWeight * 0.1 * kBoxes * kBoxes).margin(1e-3));
  }
}

// An impulse that stops what the step before left over is more than rest needs: repeated in the
// next step it throws the stack the other way, which rocks for ever within the tolerance.
TEST_CASE("a stack comes to rest well within the tolerance of its contact", "[rigid]") {
  constexpr int kBoxes = 10;
  std::string text = falling_stack(kBoxes, "0.013");
  const std::string head = "return sim.scene {";
  text.insert(text.find(head) + head.size(), " contact = sim.contact.bodies { tolerance = 1e-4 },");
  TextRun scene(text, "verlet", 0.005);
  scene.run_to(1);
  double most = 0;
  for (int n = 0; n < 200; ++n) {
    REQUIRE(scene.system.step());
    most = std::max(most, scene.system.energy().kinetic);
  }
  const double speed = std::sqrt(2 * most / kBoxes);
  CHECK(speed < 1e-4);  // m/s; 2e-4 where it rocks
}

TEST_CASE("a stack that leans too far falls and comes to rest", "[rigid]") {
  TextRun scene(stack(6, "0.3"), "verlet", 0.002);
  const double energy = scene.system.energy().total();
  scene.run_to(4);
  CHECK(scene.system.energy().total() < energy);
  double highest = 0;
  for (int i = 0; i < 6; ++i) {
    const RigidState state = scene.system.body_state(i);
    highest = std::max(highest, state.center.y());
    CHECK(state.center.y() > 0.49);
  }
  CHECK(highest < 4.5);
}

TEST_CASE("Newton's cradle gives on what hits it", "[rigid]") {
  const auto cradle = [](int hit) {
    return scene_of("table.unpack(b)", "", false,
                    "local b = {}\nfor i = 1, 5 do b[i] = sim.rigid { shape = sim.sphere { radius "
                    "= 0.1 }, mass = 1, restitution = 1, position = { 0.2 * i - (i <= " +
                        std::to_string(hit) + " and 0.3 or 0), 0, 0 }, velocity = { i <= " +
                        std::to_string(hit) + " and 1 or 0, 0, 0 } } end\n");
  };
  for (const int hit : {1, 2}) {
    TextRun scene(cradle(hit), "rk4", 0.007);
    scene.run_to(0.7);
    for (int i = 0; i < 5; ++i)
      CHECK(scene.system.body_state(i).velocity.x() == Approx(i >= 5 - hit ? 1 : 0).margin(1e-12));
    CHECK(scene.system.energy().kinetic == Approx(0.5 * hit).epsilon(1e-12));
  }
}

// Rows of points on edges and faces are redundant. Bodies that overlap at the end of a step, by g
// h^2 or so, are moved apart, which lifts them.
TEST_CASE("contact gives no energy to dominoes", "[rigid]") {
  const std::string row = R"(
local half, b = {0.00375, 0.024, 0.012}, {}
for i = 0, 2 do
  local turn = i == 0 and 4 or 0
  b[#b + 1] = sim.rigid { shape = sim.box { half = half }, mass = 0.0089, friction = 0.3,
    position = { 0.026 * i, half[2], 0 }, velocity = { turn * half[2], 0, 0 },
    angular_velocity = { 0, 0, -turn } }
end
return sim.scene { bodies = b, forces = { sim.force.gravity {} },
  contact = sim.contact.bodies { tolerance = TOLERANCE },
  colliders = { sim.collider.plane { normal = {0, 1, 0}, friction = 0.5 } },
  integrator = "verlet", dt = 0.001, duration = 1 }
)";
  for (const char* tolerance : {"1e-6", "1e-12"})
    for (const double dt : {4e-3, 2e-3, 1e-3, 5e-4}) {
      INFO("tolerance " << tolerance << ", dt " << dt);
      std::string text = row;
      text.replace(text.find("TOLERANCE"), 9, tolerance);
      TextRun run(text, "verlet", dt);
      constexpr double kWeight = 3 * 0.0089 * 9.80665;  // N, of all
      const double lift = 2 * kWeight * 9.80665 * dt * dt;
      double most = run.system.energy().total();
      for (double t = 0; t < 0.5; t += dt) {
        run.system.step();
        const double now = run.system.energy().total();
        CHECK(now < 1.003 * most + lift);
        most = std::min(most, now);
      }
      const double lean = run.system.body_state(2).axes(1, 1);
      CHECK(lean < std::cos(0.2));  // the row has fallen
    }
}

TEST_CASE("momentum stays when bodies of all shapes hit each other", "[rigid]") {
  const std::string text = scene_of(
      "sim.rigid { shape = box, mass = 1, position = {-1, 0.1, 0}, velocity = {2, 0, 0.1}, "
      "angular_velocity = "
      "{1, 2, 3}, friction = 0.4, restitution = 0.5 },\n"
      "sim.rigid { shape = box, mass = 2, position = {1, 0, 0}, velocity = {-2, 0, 0}, "
      "angular_velocity = {0, "
      "1, -2}, friction = 0.4 },\n"
      "sim.rigid { shape = ball, mass = 1, position = {0, 1.2, 0}, velocity = {0, -2, 0}, friction "
      "= 0.4 },\n"
      "sim.rigid { shape = pin, mass = 1, position = {0, -1.3, 0}, velocity = {0, 2, 0}, friction "
      "= 0.4, angular_velocity = {0, 0, 5} },\n"
      "sim.rigid { shape = pin, mass = 0.5, position = {0.1, 0, -1.3}, velocity = {0, 0, 3}, "
      "restitution = 0.3, rotation = {1, 0, 0} }",
      "", false,
      "local box, ball, pin = sim.box { half = {0.4, 0.3, 0.2} }, sim.sphere { radius = 0.3 }, "
      "sim.capsule { radius = 0.15, length = 0.5 }\n");
  for (const char* method : {"verlet", "rk4"}) {
    TextRun scene(text, method, 0.004);
    const Momentum start = momentum_of(scene.system);
    double energy = scene.system.energy().kinetic;
    for (int n = 0; n < 500; ++n) {
      REQUIRE(scene.system.step());
      const double now = scene.system.energy().kinetic;
      CHECK(now < energy * (1 + 1e-4));
      energy = now;
    }
    CHECK(scene.system.contact_work().lost > 1);
    const Momentum end = momentum_of(scene.system);
    CHECK((end.linear - start.linear).norm() < 1e-12);
    CHECK((end.angular - start.angular).norm() < 2e-3);
  }
}

TEST_CASE("contact of bodies is the same on more threads and back in time", "[rigid]") {
  const std::string text = stack(4, "0.3");
  TextRun one(text, "verlet", 0.002), two(text, "verlet", 0.002, 2);
  one.run_to(0.7);
  two.run_to(0.35);
  const Snapshot middle = two.system.snapshot();
  two.run_to(0.7);
  CHECK(one.system.hash() == two.system.hash());
  two.system.restore(middle);
  two.run_to(0.7);
  CHECK(one.system.hash() == two.system.hash());
}

// Enough that threads share the search for contact, the islands and the equations of the bodies.
TEST_CASE("a pile of hundreds of boxes has the same bits on any number of threads", "[rigid]") {
  const std::string text = R"(
local b = {}
for i = 0, 728 do
  local j = i // 81
  b[i + 1] = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} }, mass = 1, friction = 0.5,
    position = { 0.3 * (i % 9) + 0.013 * j, 0.11 + 0.21 * j, 0.3 * (i // 9 % 9) + 0.007 * j } }
end
return sim.scene { bodies = b, contact = sim.contact.bodies { tolerance = 1e-4 },
  colliders = { sim.collider.plane { friction = 0.5 } }, forces = { sim.force.gravity {} },
  integrator = 'verlet', dt = 0.005, duration = 1 }
)";
  std::uint64_t first = 0;
  for (const int threads : {1, 2, 3}) {
    INFO(threads);
    TextRun run(text, "verlet", 0.005, threads);
    run.run_to(0.1);
    CHECK(run.system.contact_work().lost > 50);
    if (threads == 1) first = run.system.hash();
    CHECK(run.system.hash() == first);
  }
}

// A ball runs into n - 1 others in a row, a small gap apart, that stay together: k of them move at
// v / k, and meet the next after k (k - 1) / 2 gaps at v. In a step of 10 ms it goes half a radius,
// and balls go further than they see on their own ways.
TEST_CASE("impulses run on through bodies that they bring together within a step", "[rigid]") {
  constexpr double kRadius = 0.1, kSpeed = 5, kStep = 0.01;
  const auto row = [](int n, double gap, const std::string& more) {
    return "local b = {}\nfor i = 1, " + std::to_string(n) +
           " do b[i] = sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 1, position = { " +
           std::to_string(2 * kRadius + gap) +
           " * i, 0, 0 }, velocity = { i == 1 and 5 or 0, 0, 0 } } end\nreturn sim.scene { bodies "
           "= b, contact = sim.contact.bodies { tolerance = 1e-9 }, forces = {}, integrator = "
           "'verlet', dt = 0.01, duration = 2" +
           more + " }\n";
  };
  for (const auto& [n, gap] : {std::pair{2, 1e-3}, {10, 1e-3}, {40, 1e-4}, {40, 1e-3}}) {
    INFO(n << " balls " << gap << " m apart");
    TextRun run(row(n, gap, ""), "verlet", kStep);
    for (int step = 1; step <= (n < 40 ? 5 : 20); ++step) {
      REQUIRE(run.system.step());
      const double t = step * kStep;
      int together = 1;
      while (together < n && t * kSpeed >= gap * together * (together + 1) / 2) ++together;
      double middle = kSpeed * t / together;
      for (int i = 0; i < together; ++i) middle += (2 * kRadius + gap) * (i + 1) / together;
      double off = 0;
      for (int i = 0; i < n; ++i) {
        const double x = i < together ? middle + (2 * i + 1 - together) * kRadius
                                      : (2 * kRadius + gap) * (i + 1);
        const RigidState ball = run.system.body_state(i);
        // On through many bodies some lag by a few gaps.
        CHECK(std::fabs(ball.center.x() - x) < (gap < 1e-3 ? 10 * gap : 1e-9));
        if (i > 0)
          CHECK(ball.center.x() - run.system.body_state(i - 1).center.x() > 2 * kRadius - 1e-9);
        off = std::max(off, std::fabs(ball.velocity.x() - (i < together ? kSpeed / together : 0)));
      }
      CHECK(off < 0.05 * kSpeed);
      CHECK(momentum_of(run.system).linear.x() == Approx(kSpeed).epsilon(1e-12));
    }
  }
  // A wall stops them, and a single particle is pushed ahead.
  const std::string end = std::to_string(0.201 * 10 + 0.1 + 0.001);
  TextRun wall(row(10, 1e-3,
                   ", colliders = { sim.collider.plane { point = {" + end +
                       ", 0, 0}, normal = {-1, 0, 0} } }"),
               "verlet", kStep);
  for (int step = 0; step < 10; ++step) {
    REQUIRE(wall.system.step());
    CHECK(wall.system.body_state(9).center.x() < 2.111 - kRadius + 1e-9);
  }
  for (int i = 0; i < 10; ++i) {
    CHECK(std::fabs(wall.system.body_state(i).center.x() - (2.111 - kRadius - 0.2 * (9 - i))) <
          1e-9);
    CHECK(wall.system.body_state(i).velocity.norm() < 1e-9);
  }
  TextRun bead("local p = sim.particles { mass = 1 }\np:add({2.111, 0, 0})\n" +
                   row(10, 1e-3, ", particles = p"),
               "verlet", kStep);
  const auto gap = [&] {
    return bead.system.position(0).x() - bead.system.body_state(9).center.x() - kRadius;
  };
  for (int step = 0; step < 3; ++step) {
    REQUIRE(bead.system.step());
    CHECK(gap() > -1e-9);
  }
  CHECK(gap() < 1e-9);
  for (int i = 0; i < 10; ++i)
    CHECK(bead.system.body_state(i).velocity.x() == Approx(kSpeed / 11).epsilon(1e-9));
}

TEST_CASE("a step of bodies that touch takes no memory", "[rigid]") {
  TextRun scene(stack(3), "verlet", 0.002);
  for (int n = 0; n < 10; ++n) REQUIRE(scene.system.step());
  const std::size_t before = sim_test::allocation_count();
  for (int n = 0; n < 10; ++n) REQUIRE(scene.system.step());
  CHECK(sim_test::allocation_count() == before);
}

TEST_CASE("what bodies cannot touch is refused by name", "[rigid]") {
  const auto why = [](const std::string& text) {
    const auto error = text_error(text);
    REQUIRE(error);
    return error->text().what + ": " + error->text().why + "; " + error->text().remedy;
  };
  const std::string ball = "sim.rigid { shape = sim.sphere { radius = 1 }, mass = 1 }";
  CHECK(contains(why(scene_of(ball, kFloor)), "body 0 (sphere) is 1 m inside a collider"));
  CHECK(contains(why(scene_of(ball + ", " + ball, "")), "body 1 (sphere) overlap by"));
  Registry registry = sim_test::make_registry();
  const SceneSpec spec = load_text(stack(2));
  CHECK_THROWS_WITH(Simulation(spec.systems[0], registry, {.integrator = MethodChoice{"dopri5"}}),
                    Catch::Contains("adaptive"));
}

// A card of half height L and half thickness t that leans at the angle a from the vertical stands
// on its inner edge. The other one presses on its upper edge, 2 L from that, with a level force H,
// by symmetry: moments about the foot give H / weight = tan(a) / 2 - t / (2 L), here 0.17199.
TEST_CASE("two cards that lean on each other stand if friction holds their feet", "[rigid]") {
  const std::string cards = R"(
local L, t, a, b = 0.045, 0.0009, math.rad(20), {}
for i, side in ipairs { 1, -1 } do
  b[i] = sim.rigid { shape = sim.box { half = { t, L, 0.03 } }, mass = 0.002, friction = FRICTION,
    position = { -side * (L * math.sin(a) + t * math.cos(a)),
                 L * math.cos(a) + t * math.sin(a), 0 },
    rotation = { 0, 0, -side * a } }
end
return sim.scene { bodies = b, forces = { sim.force.gravity {} },
  contact = sim.contact.bodies { tolerance = 1e-9 },
  colliders = { sim.collider.plane { normal = {0, 1, 0}, friction = FRICTION } },
  integrator = "verlet", dt = 0.001, duration = 0.5 }
)";
  for (const auto& [friction, stands] : {std::pair("0.170", false), std::pair("0.174", true)}) {
    INFO(friction);
    std::string text = cards;
    for (std::size_t at; (at = text.find("FRICTION")) != std::string::npos;)
      text.replace(at, 8, friction);
    TextRun run(text, "verlet", 0.001);
    const double before = run.system.body_state(0).center.y();
    run.run_to(0.5);
    const double fallen = before - run.system.body_state(0).center.y();
    CHECK((fallen < 1e-6) == stands);
    CHECK((fallen > 1e-3) == !stands);
  }
}

TEST_CASE("a collider that no particle touches changes no bit of particles beside bodies") {
  const auto end = [](const std::string& colliders) {
    TextRun run(
        "local p = sim.particles { mass = 1 }\n"
        "p:add({0, 0, 0})\np:add({0.8, 0, 0})\np:pin(0)\n"
        "local ball = sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 1,\n"
        "  position = {50, 0, 0} }\n"
        "return sim.scene { particles = p, bodies = { ball }, colliders = { " +
            colliders +
            " },\n"
            "  forces = { sim.force.spring { stiffness = 4, rest = 0.5, ties = { {0, 1} } "
            "} },\n"
            "  integrator = 'bdf2', dt = 0.01, duration = 1 }",
        "bdf2", 0.01);
    run.run_to(1);
    return run.system.position(1).x();
  };
  CHECK(end("sim.collider.plane { point = {0, -1000, 0}, normal = {0, 1, 0} }") == end(""));
}
