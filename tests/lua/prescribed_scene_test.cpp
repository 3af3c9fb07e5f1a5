// Particles that are led along paths: orders, energy, contact, and what is refused.
#include <cmath>

#include "core/session/timeline.h"
#include "core/study/energy_balance.h"
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kOmega = 7, kAmplitude = 0.2, kStiffness = 90;  // of the path; of the spring

// A particle of 1 kg on a spring of rest length 0 from one that is led along y.
std::string oscillator(const std::string& path, const std::string& more = "") {
  return "local p = sim.particles { mass = 1 }\np:add {0, 0, 0}\np:add {0, 0, 0}\nlocal w, a = 7, "
         "0.2\np:prescribe(0, " +
         path +
         ")\nlocal s = sim.force.spring { stiffness = 90 }\ns:tie(0, 1, { rest = 0 })\nlocal "
         "forces = { s }\n" +
         more +
         "return sim.scene { particles = p, forces = forces, integrator = 'rk4', dt = 0.01, "
         "duration = 1 }\n";
}

const std::string kSwing = "sim.motion.swing { amplitude = {0, a, 0}, period = 2*math.pi/w }";
const std::string kFunction = "function(t) return {0, a*math.sin(w*t), 0} end";

// y'' = w0^2 (a sin w t - y) from rest.
double exact(double t) {
  const double w0 = std::sqrt(kStiffness);
  const double forced = kAmplitude * w0 * w0 / (w0 * w0 - kOmega * kOmega);
  return forced * (std::sin(kOmega * t) - kOmega / w0 * std::sin(w0 * t));
}

double error_at_one(const SceneSpec& spec, Registry& registry, const MethodChoice& method,
                    double h) {
  Simulation system(spec.systems[0], registry, {.integrator = method, .dt = h});
  const auto steps = static_cast<int>(std::lround(1 / h));
  for (int i = 0; i < steps; ++i) REQUIRE(system.step());
  CHECK(system.position(0).y() == Approx(kAmplitude * std::sin(kOmega)).epsilon(1e-13));
  CHECK(system.velocity(0).y() == Approx(kAmplitude * kOmega * std::cos(kOmega)).epsilon(1e-9));
  return std::abs(system.position(1).y() - exact(1));
}

}  // namespace

TEST_CASE("every method keeps its order beside a particle that is led", "[lua][lead]") {
  struct Case {
    const char* method;
    double order, h;
  };
  Registry registry({SIM_PLUGIN_DIR});
  for (const std::string& path : {kSwing, kFunction}) {
    const SceneSpec spec = load_text(oscillator(path));
    for (const Case& each : {Case{"rk4", 4, 0.01},
                             {"verlet", 2, 1e-3},
                             {"yoshida4", 4, 0.01},
                             {"midpoint", 2, 1e-3},
                             {"pefrl", 4, 0.02},
                             {"euler", 1, 1e-3},
                             {"implicit_midpoint", 2, 1e-3},
                             {"trbdf2", 2, 1e-3},
                             {"bdf2", 2, 1e-3},
                             {"implicit_euler", 1, 1e-3}}) {
      const MethodChoice method{each.method};
      const double coarse = error_at_one(spec, registry, method, each.h);
      const double fine = error_at_one(spec, registry, method, each.h / 2);
      INFO(each.method << ": " << coarse << ", " << fine);
      CHECK(std::log2(coarse / fine) == Approx(each.order).margin(0.2));
      CHECK(coarse < 0.05);
    }
  }
}

TEST_CASE("adaptive methods keep their tolerance beside a particle that is led", "[lua][lead]") {
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec = load_text(oscillator(kSwing));
  for (const char* method : {"dopri5", "tsit5", "dop853", "esdirk43"}) {
    INFO(method);
    CHECK(error_at_one(spec, registry, {method, {{"tol", 1e-9}}}, 0.01) < 1e-6);
  }
}

// The energy that the spring's end supplies to the oscillator.
TEST_CASE("the work of a path is in the balance of energy", "[lua][lead]") {
  Registry registry({SIM_PLUGIN_DIR});
  const std::string damped =
      "forces[2] = sim.force.drag { k = 0.3 }\nforces[3] = sim.force.gravity { g = {0, -2, 0} }\n";
  for (const std::string& more : {std::string(), damped}) {
    const SceneSpec spec = load_text(oscillator(kSwing, more));
    for (const char* method : {"rk4", "verlet"}) {
      INFO(method);
      Simulation system(spec.systems[0], registry, {.integrator = {method}, .dt = 1e-3});
      study::EnergyBalance balance(system);
      const double before = system.energy().total();
      for (int i = 0; i < 2000; ++i) {
        REQUIRE(system.step());
        balance.advance(1);
      }
      const double change = system.energy().total() - before;
      CHECK(std::abs(change) > 0.1);
      CHECK(std::abs(change + balance.taken()) < 1e-4 * std::abs(change));
    }
  }
}

TEST_CASE("a particle that is led gives energy through contact, too", "[lua][lead]") {
  const std::string scene =
      (std::filesystem::path(SIM_SOURCE_DIR) / "scripts/scenes/ring.lua").string();
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec = load(scene, {{"n", "5"}});
  Simulation system(spec.systems[0], registry);
  study::EnergyBalance balance(system);
  const double before = system.energy().total();
  while (system.t() < 0.3) {
    REQUIRE(system.step());
    balance.advance(1);
  }
  const double change = system.energy().total() - before;
  CHECK(std::abs(change + balance.taken()) < 1e-3);  // J; 0.05 came through contact
}

// Landau & Lifshitz, Mechanics, section 30: stands where (a w)^2 > 2 g l.
TEST_CASE("a pendulum stands on a pivot that shakes fast enough", "[lua][lead]") {
  const std::string scene =
      (std::filesystem::path(SIM_SOURCE_DIR) / "scripts/scenes/kapitza.lua").string();
  Registry registry({SIM_PLUGIN_DIR});
  struct Case {
    const char* amplitude;
    bool stands;
  };
  for (const Case& each : {Case{"0.05", true}, {"0.02", false}}) {
    const SceneSpec spec = load(scene, {{"amplitude", each.amplitude}});
    for (const char* method : {"rk4", "verlet"}) {
      INFO(method << ", " << each.amplitude);
      Simulation system(spec.systems[0], registry, {.integrator = {method}});
      double lowest = 1;
      while (system.t() < 5) {
        REQUIRE(system.step());
        lowest = std::min(lowest, system.position(1).y() - system.position(0).y());
        CHECK((system.position(1) - system.position(0)).norm() == Approx(0.5).epsilon(1e-12));
      }
      CHECK((lowest > 0.4) == each.stands);
    }
  }
}

TEST_CASE("a particle that is led pushes cloth and stays on its path at colliders", "[lua][lead]") {
  const SceneSpec spec = load_text(
      "local p = sim.grid { 4, 4, du = {0.1, 0, 0}, dv = {0, 0, 0.1}, mass = 0.1 }\nlocal s = "
      "sim.force.spring { stiffness = 50, damping = 0.1, grid = p, offsets = { {0, 1}, {1, 0} } "
      "}\nfor j = 0, 3 do p:prescribe(p:id(0, j), sim.motion.line { velocity = {0, -1, 0} }) "
      "end\nreturn "
      "sim.scene { particles = p, forces = { s, sim.force.gravity { g = {0, -9.81, 0} } }, "
      "colliders = { sim.collider.plane { point = {0, -0.2, 0} } }, integrator = 'rk4', dt = "
      "0.001, duration = 1 }\n");
  Registry registry({SIM_PLUGIN_DIR});
  for (const char* method : {"rk4", "verlet", "symplectic_euler"}) {
    INFO(method);
    Simulation system(spec.systems[0], registry, {.integrator = {method}});
    for (int i = 0; i < 400; ++i) REQUIRE(system.step());
    for (int j = 0; j < 4; ++j) CHECK(system.position(j).y() == Approx(-system.t()).epsilon(1e-12));
    for (int i = 4; i < 16; ++i) CHECK(system.position(i).y() > -0.2 - 1e-9);
  }
}

TEST_CASE("steps back, snapshots and resets keep a path's bits", "[lua][lead]") {
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec = load_text(oscillator(kFunction));
  for (const char* method : {"rk4", "verlet", "dopri5", "implicit_euler"}) {
    INFO(method);
    Simulation system(spec.systems[0], registry, {.integrator = {method}});
    for (int i = 0; i < 30; ++i) REQUIRE(system.step());
    const Snapshot middle = system.snapshot();
    for (int i = 0; i < 20; ++i) REQUIRE(system.step());
    const std::vector<double> end(system.state().begin(), system.state().end());
    system.restore(middle);
    for (int i = 0; i < 20; ++i) REQUIRE(system.step());
    CHECK(std::equal(end.begin(), end.end(), system.state().begin()));
    system.reset();
    for (int i = 0; i < 50; ++i) REQUIRE(system.step());
    CHECK(std::equal(end.begin(), end.end(), system.state().begin()));
  }
}

TEST_CASE("bad paths are refused", "[lua][lead]") {
  struct Case {
    std::string text, says;
  };
  const Case cases[] = {
      {oscillator("function(t) return {1, 0, 0} end"), "its path begins at {1, 0, 0}"},
      {oscillator("function(t) return 3 end"), "expected a vector"},
      {oscillator("7"), "a motion or a function(t)"},
      {oscillator("sim.force.gravity {}"), "a motion or a function(t)"},
      {oscillator(kSwing, "p:prescribe(0, function(t) return {0, 0, 0} end)\n"),
       "prescribed twice"},
      {oscillator(kSwing, "p:prescribe(5, function(t) return {0, 0, 0} end)\n"),
       "there is no particle 5"},
      {oscillator(kSwing, "p:prescribe(-1, function(t) return {0, 0, 0} end)\n"),
       "particle id of prescribe"},
      {oscillator("function(t) return {0, 0, 0/0} end"), "a finite number"}};
  for (const Case& each : cases) {
    INFO(each.text);
    const auto error = text_error(each.text);
    REQUIRE(error);
    CHECK(contains(error->text().where, "scene.lua:"));
    CHECK_THAT(error->text().what + ": " + error->text().why, Catch::Contains(each.says));
  }
}

TEST_CASE("a particle that is led is not changed by hand", "[lua][lead]") {
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec = load_text(oscillator(kSwing));
  Simulation system(spec.systems[0], registry);
  CHECK(system.pinned(0));
  const auto kinematic = Catch::Contains("it follows a prescribed path");
  CHECK_THROWS_WITH(system.set_position(0, {1, 0, 0}), kinematic);
  CHECK_THROWS_WITH(system.set_velocity(0, {1, 0, 0}), kinematic);
  CHECK_THROWS_WITH(system.set_pinned(0, false), kinematic);
  CHECK_THROWS_WITH(system.set_held(0, true), kinematic);
  CHECK_THROWS_WITH(Simulation(spec.systems[0], registry,
                               {.integrator = {"rk4", {{"precision", std::string("single")}}}}),
                    Catch::Contains("double precision only"));
}

TEST_CASE("a path that fails on the way stops the run with its line", "[lua][lead]") {
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec = load_text(oscillator("function(t) return t < 2 and {0, 0, 0} or nil end"));
  for (const char* method : {"rk4", "verlet", "implicit_euler"}) {
    Simulation system(spec.systems[0], registry, {.integrator = {method}});
    std::string said;
    try {
      while (system.t() < 3 && system.step()) {}
    } catch (const Error& error) {
      said = error.what();
    }
    CHECK_THAT(said, Catch::Contains("scene.lua:") && Catch::Contains("path of particle 0"));
  }
}
