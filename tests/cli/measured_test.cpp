// Errors and modes that a view shows, on a fall whose errors have a closed form.
#include "cli/view/measured.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/slot.h"
#include "core/picture/quantity.h"
#include "core/study/limits/spectrum.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using Catch::Contains;
using sim_test::make_registry;

namespace {

constexpr double kStep = 0.01;  // s

// Two particles 3 m apart across and 1 m up fall by Euler's method. After n steps they are
// g h^2 n / 2 too high: x = v0 t - g h^2 n (n - 1) / 2.
double too_high(double n) { return 0.5 * sim_test::kGravity * kStep * kStep * n; }
constexpr double kSize = 3;  // m, the larger of the two

struct Fall {
  Registry registry = make_registry();
  cli::LoadedScene scene;
  std::vector<Model> models;

  explicit Fall(const std::string& more = "") {
    scene.registry = &registry;
    scene.spec = test::load_text(
        "local particles = sim.particles { mass = 1 }\n"
        "particles:add { 5, 0, 0 }\n"
        "particles:add { 8, 1, 0 }\n"
        "local forces = { sim.force.gravity {} }\n" +
        more +
        "\n"
        "return sim.scene { particles = particles, forces = forces, integrator = 'euler',\n"
        "  dt = 0.01, duration = 100 }\n");
    scene.systems.emplace_back(scene.spec.systems[0], registry, RunOptions{});
    models.push_back(make_model(scene.spec.systems[0], scene.systems[0]));
  }
  Simulation& system() { return scene.systems[0]; }
  void step(int n) {
    for (int i = 0; i < n; ++i) REQUIRE(system().step());
  }
  Frame shown(cli::Measured& measured) {
    Moment moment{take_frame(system())};
    measured.fill(moment, models);
    return moment[0];
  }
};

void require_errors(const Frame& frame, double right) {
  REQUIRE(frame.values.size() == 2);
  for (const double error : frame.values) CHECK(error == Approx(right).epsilon(1e-6).margin(1e-12));
}

}  // namespace

TEST_CASE("a view's errors are those of the run, from when they are asked for") {
  Fall fall;
  cli::Measured measured(fall.scene, fall.registry);
  CHECK(fall.shown(measured).values.empty());
  fall.step(7);
  measured.ask(1, "error");
  CHECK(measured.name() == "error");
  require_errors(fall.shown(measured), 0);
  fall.step(50);
  // From here on: the same fall, with another velocity to begin with.
  require_errors(fall.shown(measured), too_high(50));
  CHECK_FALSE(measured.parted(0).verified());
  fall.step(49);
  require_errors(fall.shown(measured), too_high(99));
  CHECK_FALSE(measured.parted(0).verified());
  fall.step(1);  // a hundred tell
  require_errors(fall.shown(measured), too_high(100));
  study::RunDeviation parted = measured.parted(0);
  REQUIRE(parted.verified());
  CHECK(parted.error == Approx(too_high(100)).epsilon(1e-6));
  CHECK(parted.at_end == Approx(too_high(100)).epsilon(1e-6));
  CHECK(parted.share == Approx(too_high(100) / kSize).epsilon(1e-6));
  CHECK_FALSE(measured.parted(1).verified());  // there is none

  // Another step: errors count anew, and so do the hundred.
  measured.touched(0, {.what = Action::What::kDt, .value = kStep});
  require_errors(fall.shown(measured), 0);
  CHECK_FALSE(measured.parted(0).verified());
  fall.step(99);
  require_errors(fall.shown(measured), too_high(99));
  CHECK_FALSE(measured.parted(0).verified());

  // Who leaves asks no more.
  measured.leave(1);
  CHECK(measured.name().empty());
  CHECK(fall.shown(measured).values.empty());
}

TEST_CASE("hands touch the run and what it is compared with alike") {
  Fall fall;
  cli::Measured measured(fall.scene, fall.registry);
  measured.ask(1, "error");
  fall.step(20);
  const auto act = [&](const Action& action) {
    measured.before_touch(0);
    apply(fall.system(), action);
    measured.touched(0, action);
  };
  using What = Action::What;
  // A jump and a push move both, so that errors stay.
  act({.what = What::kPosition, .particle = 0, .x = {0.5, 2, -1}});
  Frame frame = fall.shown(measured);
  CHECK(frame.values[0] == Approx(0).margin(1e-12));
  CHECK(frame.values[1] == Approx(too_high(20)).epsilon(1e-6));
  act({.what = What::kVelocity, .particle = 1, .x = {1, 0, 0}});
  fall.step(30);
  frame = fall.shown(measured);
  CHECK(frame.values[0] == Approx(too_high(30)).epsilon(1e-6));
  // A push changes no error of the position: velocities by Euler are exact here.
  CHECK(frame.values[1] == Approx(too_high(50)).epsilon(1e-6));
  // A particle that is held is where the hand is.
  act({.what = What::kGrab, .particle = 1});
  frame = fall.shown(measured);
  CHECK(frame.values[1] == 0);
  CHECK(frame.values[0] == Approx(too_high(30)).epsilon(1e-6));
  fall.step(10);
  frame = fall.shown(measured);
  CHECK(frame.values[1] == Approx(0).margin(1e-12));
  CHECK(frame.values[0] == Approx(too_high(40)).epsilon(1e-6));
  // Actions that come while nobody has looked since the one before.
  for (int i = 0; i < 2; ++i) {
    measured.before_touch(0);
    measured.touched(0, {.what = What::kPin, .particle = 1});
    fall.step(5);
  }
  CHECK(fall.shown(measured).values[0] == Approx(too_high(50)).epsilon(1e-6));
  // A system that is not there is no error.
  measured.before_touch(3);
  measured.touched(3, {.what = What::kGrab, .particle = 0});
}

TEST_CASE("what the last one asked for is shown to all") {
  Fall fall(
      "local spring = sim.force.spring { stiffness = 40 }\n"
      "spring:tie(0, 1)\n"
      "forces[2] = spring");
  fall.step(3);
  cli::Measured measured(fall.scene, fall.registry);
  measured.ask(1, "mode");
  CHECK(fall.shown(measured).values == study::fastest_mode(fall.system()));
  measured.ask(2, "error");
  CHECK(measured.name() == "error");
  CHECK(fall.shown(measured).values == std::vector<double>{0, 0});
  // Colours that need no measure are none of its own.
  measured.ask(2, "plain");
  CHECK(measured.name() == "mode");
  CHECK(fall.shown(measured).values == study::fastest_mode(fall.system()));
  measured.ask(3, "error");
  measured.ask(1, "speed");
  CHECK(measured.name() == "error");
  measured.leave(2);
  CHECK(measured.name() == "error");
  measured.ask(1, "energy");
  CHECK(measured.name() == "energy");
  const Frame frame = fall.shown(measured);
  CHECK(frame.values == sim::quantity(fall.models[0], take_frame(fall.system()), "energy"));
  CHECK(frame.values.size() == 2);
  CHECK_THROWS_WITH(measured.ask(1, "colours of " + std::string(100, 'x')),
                    Contains("unknown colour 'colours of xxx") && Contains("known: plain, ") &&
                        Contains("error") && !Contains(std::string(30, 'x')));
  CHECK(measured.name() == "energy");
}

TEST_CASE("errors are known without being asked where they cost little") {
  Fall fall;
  cli::Measured measured(fall.scene, fall.registry);
  measured.afford(true);
  fall.step(100);
  CHECK(fall.shown(measured).values.empty());
  REQUIRE(measured.parted(0).verified());
  CHECK(measured.parted(0).error == Approx(too_high(100)).epsilon(1e-6));
  // It goes on when it is asked for, and when it is afforded no more.
  measured.afford(true);
  CHECK(measured.parted(0).verified());
  measured.afford(false);
  CHECK_FALSE(measured.parted(0).verified());
  fall.step(100);
  fall.shown(measured);
  CHECK_FALSE(measured.parted(0).verified());
  measured.ask(1, "error");
  fall.step(100);
  require_errors(fall.shown(measured), too_high(100));
  measured.afford(true);
  measured.afford(false);
  CHECK(measured.parted(0).verified());
}
