// Particles that slide over an edge of what they rest on, against the closed form.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kG = 9.81, kDrag = 0.5, kEdge = 0.6, kTop = 0.5, kLast = 1;

// A table of 1.2 m, on which particles of 1 kg slide under drag, which pulls them back.
std::string table(const std::string& particles, double friction, const std::string& more = "") {
  return "local p = sim.particles { mass = 1 }\n" + particles +
         "\nreturn sim.scene { particles = p, accuracy = 'event', colliders = {\n"
         "  sim.collider.box { center = {0, 0.4, 0}, half = {0.6, 0.1, 0.6}, friction = " +
         std::to_string(friction) +
         " } },\n"
         "  forces = { sim.force.gravity {}, sim.force.drag { k = 0.5 } }" +
         more + ", integrator = 'rk4', dt = 0.01, duration = 1 }";
}

// v' = -k v - mu g along the way until the edge, then v' = -k v + g.
Vec3 slid(const Vec3& x, const Vec3& v, double friction) {
  const Vec3 along = v / v.norm();
  const double braked = friction * kG / kDrag;
  const auto way = [&](double t) {
    return (v.norm() + braked) * (1 - std::exp(-kDrag * t)) / kDrag - braked * t;
  };
  const double far = (kEdge - x.x()) / along.x();
  double before = 0, after = kLast;
  for (int n = 0; n < 60; ++n) {
    const double middle = 0.5 * (before + after);
    (way(middle) < far ? before : after) = middle;
  }
  const double fall = kLast - after,
               speed = (v.norm() + braked) * std::exp(-kDrag * after) - braked;
  const double share = (1 - std::exp(-kDrag * fall)) / kDrag;
  return x + (far + speed * share) * along - Vec3(0, kG / kDrag * fall - kG / kDrag * share, 0);
}

}  // namespace

TEST_CASE("what slides over an edge falls from there on, by methods that end steps at touches",
          "[scene]") {
  const std::string start = "p:add({0, 0.5, 0.013}, { velocity = {1.9, 0, 0.4} })";
  for (const double friction : {0.0, 0.1})
    for (const MethodChoice& method :
         {MethodChoice{"dopri5", {{"tol", 1e-8}}}, MethodChoice{"dop853", {{"tol", 1e-8}}},
          MethodChoice{"bs23", {{"tol", 1e-8}}}, MethodChoice{"esdirk43", {{"tol", 1e-8}}},
          MethodChoice{"rk4"}})
      for (const double dt : {0.01, 0.0037}) {
        INFO(method.name << " " << dt << " friction " << friction);
        const SceneSpec scene = load_text(table(start, friction));
        Registry registry({SIM_PLUGIN_DIR});
        Simulation system(scene.systems[0], registry, {.integrator = method, .dt = dt});
        while (system.t() < kLast - 1e-9) REQUIRE(system.step_to(std::min(kLast, system.t() + dt)));
        const Vec3 end = slid({0, kTop, 0.013}, {1.9, 0, 0.4}, friction);
        CHECK((system.position(0) - end).norm() < 1e-6);
      }
}

TEST_CASE("rods slide over an edge alike by all methods that end steps at touches",
          "[scene][constraints]") {
  const std::string text = table(
      "p:add({0, 0.5, 0.013}, { velocity = {1, 0, 0} })\n"
      "p:add({-0.5, 0.5, 0.013}, { velocity = {1, 0, 0} })",
      0, ", constraints = { sim.constraint.distance { ties = { {0, 1} } } }");
  TextRun fine(text, "rk4", 1e-3);
  fine.run_to(kLast);
  for (const char* const method : {"dopri5", "bs23", "esdirk43", "trbdf2", "bdf2"}) {
    INFO(method);
    TextRun run(text, method, 0.004);
    run.run_to(kLast);
    CHECK((run.system.position(0) - fine.system.position(0)).norm() < 2e-4);
    CHECK((run.system.position(1) - fine.system.position(1)).norm() < 2e-4);
  }
}
