// Particles that lie on surfaces in steps that end at touches: closed forms and the balance.
#include <cmath>

#include "core/study/energy_balance.h"
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kG = 9.81, kAngle = 0.5;  // of a slope, rad

// A particle of 2 kg that starts on a plane, with the speed `along` down its slope.
std::string slide(double angle, double friction, double along, const std::string& motion) {
  // Numbers with all their digits.
  char text[200];
  std::snprintf(text, sizeof text, "local c, s = math.cos(%.17g), math.sin(%.17g)\n", angle, angle);
  return std::string(text) +
         "local p = sim.particles { mass = 2 }\np:add({0, 0, 0}, { velocity = {" +
         std::to_string(along) + "*c, -" + std::to_string(along) + "*s" + ", 0} })\n" +
         "return sim.scene { particles = p, forces = { sim.force.gravity { g = {0, -9.81, 0} } },\n"
         "colliders = { sim.collider.plane { normal = {s, c, 0}, friction = " +
         std::to_string(friction) + motion +
         " } }, accuracy = 'event', integrator = 'dopri5', dt = 0.01, duration = 1 }\n";
}

struct End {
  Vec3 x, v;
  double off = 0, taken = 0;  // of E + W, and W, J
};

End run(const std::string& text, const MethodChoice& method) {
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec = load_text(text);
  Simulation system(spec.systems[0], registry, {.integrator = method, .dt = 0.01});
  study::EnergyBalance balance(system);
  const double start = system.energy().total();
  for (int i = 0; i < 100; ++i) {
    REQUIRE(system.step());
    balance.advance();
    balance.look();
  }
  return {system.position(0), system.velocity(0), system.energy().total() + balance.taken() - start,
          balance.taken()};
}

const char* const kMethods[] = {"rk4", "dopri5", "tsit5"};

}  // namespace

TEST_CASE("a particle slides down a slope as the closed form says", "[lua][colliders]") {
  const double c = std::cos(kAngle), s = std::sin(kAngle);
  for (const char* const method : kMethods)
    for (const double friction : {0.0, 0.2, 0.8}) {
      if (friction > 0.5 && method == kMethods[0])
        continue;  // its steps do not end where it sticks
      const double along = friction > 0.5 ? 1.0 : 0.0;
      const End end = run(slide(kAngle, friction, along, ""), MethodChoice{method});
      const double a = kG * (s - friction * c);
      // With more friction than tan(angle) it comes to rest and stays.
      const double t = a < 0 ? std::min(1.0, -along / a) : 1.0;
      const double way = along * t + 0.5 * a * t * t, speed = a < 0 && t < 1 ? 0 : along + a * t;
      INFO(method << ", friction " << friction << ": " << end.x.norm() << " m, not " << way);
      CHECK((end.x - way * Vec3(c, -s, 0)).norm() < 1e-5);
      CHECK((end.v - speed * Vec3(c, -s, 0)).norm() < 1e-5);
      const double lost = 2 * friction * kG * c * way;
      CHECK(end.taken == Approx(lost).margin(2e-4));
      CHECK(std::fabs(end.off) < 1e-4);
    }
}

TEST_CASE("a surface that carries a particle gives it the work that it takes", "[lua][colliders]") {
  for (const char* const method : {"dopri5", "tsit5"}) {
    // A lift at constant speed: m g v t, while the particle moves with it.
    const End lifted = run(slide(0, 0, 0, ", motion = sim.motion.line { velocity = {0, 0.5, 0} }"),
                           MethodChoice{method});
    INFO(method);
    CHECK((lifted.x - Vec3(0, 0.5, 0)).norm() < 1e-6);
    // The first touch throws it to the speed of the lift.
    CHECK(lifted.taken == Approx(-2 * kG * 0.5 - 0.5 * 2 * 0.25).epsilon(1e-3));
    CHECK(std::fabs(lifted.off) < 1e-2);
    // A belt takes it along by friction: mu g until it is as fast, then with it.
    const End belt = run(slide(0, 0.3, 0, ", motion = sim.motion.line { velocity = {1, 0, 0} }"),
                         MethodChoice{method});
    const double until = 1 / (0.3 * kG);
    CHECK((belt.x - Vec3(0.5 * until + (1 - until), 0, 0)).norm() < 1e-5);
    CHECK(belt.v[0] == Approx(1).epsilon(1e-6));
    CHECK(belt.taken == Approx(-1).epsilon(2e-3));
  }
}

// It goes along as long as A (2 pi / T)^2 < g, up and down.
TEST_CASE("what lies on a surface that swings stays on it, also where it goes away",
          "[lua][colliders]") {
  const double amplitude = 0.05, period = 0.9, rate = 2 * M_PI / period;
  char text[600];
  std::snprintf(text, sizeof text,
                "local p = sim.particles { mass = 2 }\n"
                "p:add({0, 0, 0}, { velocity = {0.3, %.17g, 0} })\n"
                "return sim.scene { particles = p, forces = { sim.force.gravity {} }, colliders = "
                "{\n sim.collider.plane { motion = sim.motion.swing { amplitude = {0, %.17g, 0}, "
                "period = %.17g } } },\n"
                "accuracy = 'event', integrator = 'rk4', dt = 0.01, duration = 1 }\n",
                amplitude * rate, amplitude, period);
  for (const char* const method : kMethods) {
    TextRun scene(text, method, 0.01);
    double off = 0;
    for (int i = 0; i < 100; ++i) {
      REQUIRE(scene.system.step());
      const double t = scene.system.t();
      const Vec3 x = scene.system.position(0), v = scene.system.velocity(0);
      off = std::max(off, (x - Vec3(0.3 * t, amplitude * std::sin(rate * t), 0)).norm());
      off = std::max(off, (v - Vec3(0.3, amplitude * rate * std::cos(rate * t), 0)).norm());
    }
    INFO(method);
    CHECK(off < 1e-5);
  }
}

TEST_CASE("implicit methods bounce without a loss of order", "[lua][colliders]") {
  // Free fall is exact with all of them, so that bounces are, too: from 1 m with restitution 0.8,
  // times and speeds of the flights are a geometric series.
  const std::string ball =
      "local p = sim.particles { mass = 1 }\n"
      "p:add({0, 1, 0}, { velocity = {0.5, 0, 0} })\n"
      "return sim.scene { particles = p, forces = { sim.force.gravity { g = {0, -9.81, 0} } },\n"
      "colliders = { sim.collider.plane { normal = {0, 1, 0}, restitution = 0.8 } },\n"
      "accuracy = 'event', integrator = 'rk4', dt = 0.01, duration = 2 }\n";
  const double hit = std::sqrt(2 / kG), speed = kG * hit;
  double begin = hit, up = 0.8 * speed;  // of the flight that lasts at 1 s
  while (begin + 2 * up / kG < 1) begin += 2 * up / kG, up *= 0.8;
  const double t = 1 - begin;
  for (const char* const method : {"rk4", "implicit_midpoint", "trbdf2", "bdf2", "esdirk43"}) {
    CAPTURE(method);
    const End end = run(ball, MethodChoice{method});
    CHECK(end.x.y() == Approx(up * t - 0.5 * kG * t * t).margin(1e-10));
    CHECK(end.v.y() == Approx(up - kG * t).margin(1e-10));
    CHECK(end.x.x() == Approx(0.5).margin(1e-12));
    CHECK(std::fabs(end.off) < 1e-10);
  }
}
