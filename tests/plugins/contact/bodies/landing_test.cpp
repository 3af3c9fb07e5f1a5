// Bodies without restitution whose edges land one after the other, by closed forms.
#include <cmath>
#include <string>

#include "tests/lua/scene_text.h"
#include "tests/support/momentum.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kA = 0.05, kB = 0.1, kSpeed = 4;  // half width and height, m; m/s

// A tall slab, tilted a little, that falls onto rough ground, or a plate, without gravity.
std::string slab(const std::string& tilt, const std::string& ground) {
  return "local slab = sim.rigid { shape = sim.box { half = {0.05, 0.1, 0.05} }, mass = 1, "
         "position = {0, 0.111, 0}, velocity = {0, -4, 0}, rotation = {0, 0, " +
         tilt + "}, friction = 10 }\n" + ground +
         "forces = {}, integrator = 'verlet', dt = 0.005, duration = 0.02 }\n";
}

const std::string kFloor =
    "return sim.scene { bodies = { slab }, colliders = { sim.collider.plane { friction = 10 } }, ";

// The same of two halves.
std::string halves(const std::string& tilt) {
  return "local tilt, joints, halves = " + tilt +
         ", sim.constraint.joint {}, {}\n"
         "for k, s in ipairs { -1, 1 } do\n"
         "  halves[k] = sim.rigid { shape = sim.box { half = {0.05, 0.05, 0.05} }, mass = 0.5,\n"
         "    position = { -0.05 * s * math.sin(tilt), 0.111 + 0.05 * s * math.cos(tilt), 0 },\n"
         "    velocity = {0, -4, 0}, rotation = {0, 0, tilt}, friction = 10 }\nend\n"
         "for _, x in ipairs { -0.05, 0.05 } do for _, z in ipairs { -0.05, 0.05 } do\n"
         "  joints:tie(halves[1]:at {x, 0.05, z}, halves[2]:at {x, -0.05, z})\nend end\n"
         "return sim.scene { bodies = halves, constraints = { joints },\n"
         "  colliders = { sim.collider.plane { friction = 10 } },\n"
         "  forces = {}, integrator = 'verlet', dt = 0.005, duration = 0.02 }\n";
}

}  // namespace

// The momentum about an edge stays when it lands; the slab turns freely until the next one does
// (Housner (1963) has the limit of no tilt). Returns its angular velocity then, rad/s.
double rocked(double tilt) {
  const double inertia = (kA * kA + kB * kB) / 3, about_edge = 4 * inertia;
  const double lever = kA * std::cos(tilt) - kB * std::sin(tilt),
               height = kA * std::sin(tilt) + kB * std::cos(tilt), w = kSpeed * lever / about_edge;
  const double vx = w * height, vy = -w * lever;
  const auto edge = [&](double t) {  // the second, from the center
    const double angle = tilt - w * t;
    return Vec3(kA * std::cos(angle) + kB * std::sin(angle),
                kA * std::sin(angle) - kB * std::cos(angle), 0);
  };
  double low = 0, high = 3 * tilt / w;
  for (int halving = 0; halving < 100; ++halving) {
    const double t = 0.5 * (low + high);
    (height + vy * t + edge(t).y() > 0 ? low : high) = t;
  }
  const Vec3 arm = -edge(low);
  return (arm.x() * vy - arm.y() * vx - inertia * w) / about_edge;
}

TEST_CASE("a tall slab rocks over from the edge that lands first to the other", "[rigid]") {
  for (const std::string tilt : {"0.05", "0.01", "1e-3", "1e-4", "1e-6"})
    for (const double dt : {0.01, 0.005, 0.001, 0.0001}) {
      TextRun run(slab(tilt, kFloor), "verlet", dt);
      run.run_to(0.02);
      const double exact = rocked(std::stod(tilt)),
                   error = run.system.body_state(0).angular_velocity.z() / exact - 1;
      INFO("tilt " << tilt << ", step " << dt);
      // Gaps change linearly with the angle between impacts of one step.
      CHECK(std::fabs(error) < 1e-6 + 0.5 * std::pow(std::stod(tilt), 2));
      if (dt < 2e-4) CHECK(std::fabs(error) < 1e-6);
    }
}

// Joints carry the impulse of an edge to the other half, and the moves that it causes.
TEST_CASE("two halves of a slab that joints hold together land as the slab does", "[rigid]") {
  for (const std::string tilt : {"0.05", "0.01", "1e-3"})
    for (const double dt : {0.005, 0.001, 0.0001}) {
      TextRun run(halves(tilt), "verlet", dt);
      run.run_to(0.02);
      INFO("tilt " << tilt << ", step " << dt);
      // The joints of a step do not turn with the halves between its impacts.
      for (const int half : {0, 1}) {
        const double w = run.system.body_state(half).angular_velocity.z();
        CHECK(std::fabs(w / rocked(std::stod(tilt)) - 1) < std::stod(tilt));
      }
    }
}

// Impulses that bounce run through joints, too, and so do the moves that they cause.
TEST_CASE("two halves of a slab that joints hold together bounce as the slab does", "[rigid]") {
  const auto bouncing = [](std::string scene) {
    for (std::size_t at; (at = scene.find("friction = 10")) != std::string::npos;)
      scene.replace(at, 13, "restitution = 0.5");
    return scene;
  };
  for (const std::string tilt : {"0.05", "0.01", "1e-3"})
    for (const double dt : {0.005, 0.001}) {
      TextRun one(bouncing(slab(tilt, kFloor)), "verlet", dt),
          two(bouncing(halves(tilt)), "verlet", dt);
      one.run_to(0.02), two.run_to(0.02);
      INFO("tilt " << tilt << ", step " << dt);
      const double w = one.system.body_state(0).angular_velocity.z();
      CHECK(std::fabs(two.system.body_state(0).angular_velocity.z() / w - 1) < std::stod(tilt));
    }
}

// A capsule that lies at an angle of 0.1 rad and falls on one of its ends, then on the other.
// Without friction an impact changes the rate r at an end by (1 + e) r, with an impulse of (1 + e)
// r / (1/m + lever^2 / I); in between it turns freely.
TEST_CASE("a capsule that bounces on one end and then the other is pushed where it is then",
          "[rigid]") {
  constexpr double kTilt = 0.1, kHalf = 0.1, kRadius = 0.02, kRestitution = 0.5, kTime = 0.03;
  const std::string scene =
      "local b = sim.rigid { shape = sim.capsule { radius = 0.02, length = 0.2 }, mass = 1,\n"
      "  position = {0, 0.05, 0}, velocity = {0, -1, 0}, restitution = 0.5,\n"
      "  rotation = {0, 0, math.pi / 2 + 0.1} }\n"
      "return sim.scene { bodies = { b }, colliders = { sim.collider.plane {} }, forces = {},\n"
      "  integrator = 'verlet', dt = 0.005, duration = 0.03 }\n";
  for (const double dt : {0.01, 0.001, 0.0001}) {
    TextRun run(scene, "verlet", dt);
    const double inertia = run.system.body(0).inertia(run.system.body_state(0))(2, 2);
    double angle = kTilt, y = kHalf * std::sin(kTilt) + kRadius, vy = -1, w = 0;
    const auto hit = [&](double side) {
      const double lever = side * kHalf * std::cos(angle);
      const double push = -(1 + kRestitution) * (vy + w * lever) / (1 + lever * lever / inertia);
      vy += push, w += lever * push / inertia;
    };
    hit(-1);
    double low = 0, high = kTime;
    for (int halving = 0; halving < 100; ++halving) {
      const double t = 0.5 * (low + high);
      (y + vy * t + kHalf * std::sin(angle + w * t) > kRadius ? low : high) = t;
    }
    angle += w * low;
    hit(1);
    run.run_to(0.04);
    INFO("step " << dt << ", at " << low);
    const double order2 = 1e-9 + 0.1 * dt * dt;
    CHECK(run.system.body_state(0).angular_velocity.z() == Approx(w).epsilon(order2));
    CHECK(run.system.body_state(0).velocity.y() == Approx(vy).epsilon(order2));
  }
}

// Edges land at once if the gap of one is none when the other lands.
TEST_CASE("a slab that falls flat stands where it falls", "[rigid]") {
  for (const std::string tilt : {"0", "1e-9"})
    for (const double dt : {0.01, 0.005, 0.001}) {
      TextRun run(slab(tilt, kFloor), "verlet", dt);
      run.run_to(0.02);
      const RigidState state = run.system.body_state(0);
      INFO("tilt " << tilt << ", step " << dt);
      CHECK(state.angular_velocity.norm() < 1e-9);
      CHECK(state.velocity.norm() < 1e-9);
      CHECK(std::fabs(state.center.y() - kB) < 1e-9);
    }
}

TEST_CASE("momentum stays when edges land on a body in turn", "[rigid]") {
  TextRun run(slab("0.01",
                   "local plate = sim.rigid { shape = sim.box { half = {0.3, 0.02, 0.3} }, mass = "
                   "2, position = {0.02, -0.02, 0}, friction = 0.4 }\n"
                   "return sim.scene { bodies = { slab, plate }, "),
              "verlet", 0.005);
  const auto before = sim_test::momentum_of(run.system);
  run.run_to(0.02);
  const auto after = sim_test::momentum_of(run.system);
  CHECK((after.linear - before.linear).norm() < 1e-13);
  // Moves that separate bodies in the end change it a little.
  CHECK((after.angular - before.angular).norm() < 1e-5);  // kg m^2/s
  CHECK(run.system.body_state(1).velocity.y() < -1);
}
