// The energy that contact takes, by every method, is booked at the moment that the positions and
// velocities of the method belong to.
#include <cmath>

#include "core/study/energy_balance.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"
#include "tests/support/tank.h"

using namespace sim;

namespace {

constexpr double kGravity = 9.81, kStep = 0.005, kSpeed = 0.3;  // m/s^2, s, m/s
constexpr int kSteps = 100;

const char* const kLift =
    "local lift = sim.collider.plane { normal = {0, 1, 0}, point = {0, 0, 0},\n"
    "  motion = sim.motion.line { velocity = {0, 0.3, 0} } }\n";

std::string end(const std::string& fields) {
  return "return sim.scene { " + fields +
         ", forces = { sim.force.gravity { g = {0, -9.81, 0} } }, integrator = 'verlet',\n"
         "  dt = 0.005, duration = 0.5 }\n";
}

// Something of 1 kg that lies on the lift and goes up with it: by a method that fits, or nothing.
struct Lifted {
  std::string name, text;
};

const std::vector<Lifted>& lifted() {
  static const std::vector<Lifted> all{
      {"a particle", std::string(kLift) +
                         "local p = sim.particles { mass = 1 }\n"
                         "p:add({0, 0, 0}, { velocity = {0, 0.3, 0} })\n" +
                         end("particles = p, colliders = { lift }")},
      {"a rod", std::string(kLift) +
                    "local p = sim.particles { mass = 0.5 }\n"
                    "p:add({0, 0, 0}, { velocity = {0, 0.3, 0} })\n"
                    "p:add({1, 0, 0}, { velocity = {0, 0.3, 0} })\n"
                    "local rod = sim.constraint.distance {}\n"
                    "rod:tie(0, 1)\n" +
                    end("particles = p, colliders = { lift }, constraints = { rod }")},
      {"a box", std::string(kLift) +
                    "local box = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} },\n"
                    "  mass = 1, position = {0, 0.1, 0}, velocity = {0, 0.3, 0} }\n" +
                    end("bodies = { box }, colliders = { lift }")}};
  return all;
}

bool settles(const Simulation& system) {
  for (int i = 0; i < system.particles(); ++i)
    if (std::abs(system.velocity(i)[1] - kSpeed) > 1e-6) return false;
  return true;
}

}  // namespace

// The lift does m g u t = 1.47 J. Kicks that come before drifts leave velocities half a step behind
// positions: books of both as if they were of one moment are off by m g^2 h t / 2 = 0.12 J.
TEST_CASE("a lift gives what it lifts the work m g u t, by every method and correction") {
  for (const auto& [name, text] : lifted()) {
    const SceneSpec scene = test::load_text(text);
    Registry registry({SIM_PLUGIN_DIR});
    int tried = 0;
    for (const std::string& method : sim_test::methods_for(scene.systems[0], registry)) {
      std::optional<Simulation> system;
      try {
        system.emplace(scene.systems[0], registry, RunOptions{.integrator = method, .dt = kStep});
      } catch (const Error&) {  // it does not fit
        continue;
      }
      INFO(name << ", " << method);
      ++tried;
      const double start = system->energy().total();
      REQUIRE(sim_test::run(*system, kSteps));
      const ContactWork work = system->contact_work();
      const double rise = system->energy().total() - start;
      const bool held = method != "euler" || name != "a particle";
      CHECK(work.given - work.lost == Approx(rise).epsilon(held ? 1e-9 : 1e-3));
      if (!held) continue;  // Euler's method lets a particle hop on a surface that comes
      CHECK(settles(*system));
      CHECK(rise == Approx(kGravity * kSpeed * kSteps * kStep).epsilon(1e-9));
    }
    CHECK(tried > 8);
  }
}

// A scene at rest gains nothing and loses nothing, however it is kept where it is.
TEST_CASE("contact of surfaces and a pressed fluid at rest take no energy, by every method") {
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec squares = test::load_text(
      "local p = sim.particles { mass = 1 }\nlocal triangles = {}\n"
      "for s = 0, 1 do\n"
      "  for i = 0, 3 do p:add { (i % 2) * (s == 0 and 1 or 0.5), 0.01001 * s, (i // 2) * 0.7 } "
      "end\n"
      "  triangles[#triangles + 1] = { 4 * s, 4 * s + 2, 4 * s + 1 }\n"
      "  triangles[#triangles + 1] = { 4 * s + 1, 4 * s + 2, 4 * s + 3 }\n"
      "end\n"
      "p:pin(0, 1, 2, 3)\n"
      "local squares = sim.surface { particles = p, triangles = triangles }\n" +
      end("particles = p, contact = sim.contact { surfaces = { squares }, thickness = 0.01 }"));
  const sim_test::Tank pool{.nx = 6, .ny = 6, .length = 0.12, .solver = "dfsph"};
  struct Case {
    std::string name;
    SystemSpec spec;
    double mass;  // kg, that is held up
  };
  const Case cases[] = {{"squares", squares.systems[0], 4},
                        {"a pool", sim_test::make_tank(pool, registry), 14.4}};
  for (const auto& [name, spec, mass] : cases)
    for (const std::string& method : sim_test::methods_for(spec, registry)) {
      std::optional<Simulation> system;
      try {
        system.emplace(spec, registry, RunOptions{.integrator = method, .dt = kStep});
      } catch (const Error&) {
        continue;
      }
      INFO(name << ", " << method);
      const double start = system->energy().total();
      REQUIRE(sim_test::run(*system, kSteps));
      const ContactWork work = system->contact_work();
      const double late = 0.5 * mass * kGravity * kGravity * kStep * kSteps * kStep;  // J
      CHECK(std::abs(system->energy().total() + work.lost - work.given - start) < 0.01 * late);
    }
}
