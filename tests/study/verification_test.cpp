// When runs are verified, and for how long.
#include "core/study/run/verification.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <thread>

#include "core/study/run/follow.h"
#include "tests/lua/scene_text.h"
#include "tests/study/judged_run.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::Track;
using sim::study::Trust;
using sim::study::VerificationPlan;
using sim::study::Verify;

namespace {

bool go_on() { return false; }

// The verdict after a run that is said to have taken so many seconds.
struct Verified {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_cloth(4);
  sim::Simulation system{spec, registry, {.integrator = "verlet", .dt = 0.005}};
  std::vector<Track> tracks;
  int told = 0;

  Verified() { tracks.emplace_back(spec, system, 400, Track::kNever, Track::kNever, &registry); }
  sim::study::Verdict behind(const VerificationPlan& plan, double seconds) {
    follow(tracks[0], go_on);
    sim::study::verify(plan, tracks, seconds, go_on, [&](double, double) { ++told; });
    return tracks[0].verdict();
  }
};

bool says(const sim::study::Verdict& verdict, const std::string& words) {
  return verdict.reason.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("short runs are verified, and none where that is not wanted") {
  CHECK(Verified().behind({}, 0.5).trust == Trust::kTrusted);
  const auto none = Verified().behind({.wish = Verify::kNever}, 0.5);
  CHECK(none.trust == Trust::kUnverified);
  CHECK(says(none, "; positions not verified"));
}

TEST_CASE("a long run is verified behind it for no longer than is allowed") {
  const auto hardly = Verified().behind({.seconds = 1e-9}, 60);
  CHECK(hardly.trust == Trust::kUnverified);
  CHECK(says(hardly, "; positions not verified: --verify takes about 2 min"));
  // It takes milliseconds here, whatever is said of the run.
  for (const VerificationPlan& plan :
       {VerificationPlan{.seconds = 60}, VerificationPlan{.seconds = 1e-9, .share = 1}}) {
    Verified run;
    const auto enough = run.behind(plan, 60);
    CHECK(enough.trust == Trust::kTrusted);
    CHECK(says(enough, "(verified)"));
    CHECK(run.told == 0);
  }
  Verified always;
  CHECK(always.behind({.wish = Verify::kAlways, .seconds = 1e-9}, 60).trust == Trust::kTrusted);
  CHECK(always.told == 1);
}

TEST_CASE("a pulse is looked for also where positions were verified before") {
  const sim::SystemSpec spec =
      make_field({0.1, 0}, [](double t, std::span<const double> x, std::span<double> d) {
        d[0] = x[1];
        d[1] = -x[0] + (t > 3.1 && t < 3.11 ? 100 : 0);
      });
  for (const double dt : {0.02, 1e-4}) {
    INFO(dt);
    sim::Registry registry = make_registry();
    sim::Simulation system(spec, registry, {.integrator = "rk4", .dt = dt});
    std::vector<Track> tracks;
    tracks.emplace_back(spec, system, std::llround(6 / dt), Track::kNever, Track::kNever,
                        &registry);
    sim::study::RunDeviation known;
    known.outcome = sim::study::RunDeviation::Outcome::kCompared;
    known.error = known.at_end = known.share = 1e-6;
    tracks[0].verified_by(std::move(known), HUGE_VAL);
    CHECK_FALSE(verify_beside({}, tracks, 1, go_on));
    follow(tracks[0], go_on);
    int told = 0;
    sim::study::verify({}, tracks, 60, go_on, [&](double, double) { ++told; });
    CHECK(told == 0);
    const auto verdict = tracks[0].verdict();
    INFO(verdict.reason);
    CHECK(verdict.trust == (dt > 0.01 ? Trust::kSuspect : Trust::kTrusted));
    CHECK(says(verdict, "has a pulse near t = 3.1") == (dt > 0.01));
  }
}

TEST_CASE("a refined run takes a core that the run leaves alone") {
  Verified all;
  CHECK_FALSE(verify_beside({}, all.tracks, 1024, go_on));
  CHECK_FALSE(verify_beside({.wish = Verify::kNever}, all.tracks, 1, go_on));
  all.tracks[0].sample();
  const bool begun = verify_beside({}, all.tracks, 1, go_on);
  CHECK(begun == (std::thread::hardware_concurrency() > 1));
  CHECK(all.tracks[0].verifies_beside() == begun);
  // To its end, though no time is left behind the run.
  if (begun) CHECK(all.behind({.seconds = 1e-9}, 60).trust == Trust::kTrusted);
}

// Half the step differs by 2 mm, a quarter by 1.4 mm, the sixteenth by 9.2 mm: layers that touch a
// little later slide elsewhere.
TEST_CASE("a cloth in a ring is not said to be four times as exact as it is") {
  const sim::SceneSpec scene =
      sim::test::load(SIM_SOURCE_DIR "/scripts/scenes/ring.lua", {{"n", "12"}});
  sim::Registry registry = make_registry();
  sim::Simulation system(scene.systems[0], registry, {.integrator = "verlet", .dt = 0.000745});
  Track track(scene.systems[0], system, 269, Track::kNever, Track::kNever, &registry);
  follow(track, go_on);
  track.verify(go_on);
  const sim::study::Verdict verdict = track.verdict();
  INFO(verdict.reason);
  CHECK(verdict.figures.shadow.error > 2.0 / 3 * 9.2e-3);
  CHECK(verdict.figures.shadow.error < 4 * 9.2e-3);
}

// Both the run and half of it end a step where the ball lands and begins to roll.
TEST_CASE("a ball that lands on a slope is not said to be right to a micrometre") {
  sim::Registry registry = make_registry();
  const sim::SceneSpec scene =
      sim::load_scene("ball.lua", registry, {.search_path = {SIM_SOURCE_DIR "/scripts"}, .text = R"(
local sim = require 'sim'
return sim.scene { name = 'ball', forces = { sim.force.gravity {} },
  bodies = { sim.rigid { shape = sim.sphere { radius = 0.27 }, mass = 0.12,
    position = {0.0855, 0.75, 0}, velocity = {-0.426, -0.904, 0.031},
    friction = 0.053, restitution = 0 } },
  colliders = { sim.collider.plane { normal = {0.3, 1, 0}, friction = 0.053 } },
  integrator = 'verlet', dt = 0.002, duration = 0.5 })"});
  sim::Simulation system(scene.systems[0], registry,
                         {.integrator = "implicit_midpoint", .dt = 5e-3});
  Track track(scene.systems[0], system, 100, Track::kNever, Track::kNever, &registry);
  follow(track, go_on);
  track.verify(go_on);
  const sim::study::Verdict verdict = track.verdict();
  sim::Simulation fine(scene.systems[0], registry, {.integrator = "rk4", .dt = 5e-3 / 64});
  for (int left = 6400; left > 0;) left -= fine.steps(left);
  double error = 0;
  for (int i = 0; i < fine.particles(); ++i)
    error = std::max(error, (system.position(i) - fine.position(i)).norm());
  INFO(verdict.reason << ' ' << error);
  CHECK(error > 1e-4);
  CHECK(verdict.figures.shadow.error > 2.0 / 3 * error);
  CHECK(verdict.figures.shadow.error < 20 * error);
  CHECK(verdict.trust == Trust::kTrusted);
}

// The steps of bdf grow only where it pays by half: with a tenth of the tolerance they are nearly
// the same at 1e-6, so that both runs have the same error.
TEST_CASE("the error of a method of coarse step sizes is not told from the same steps again") {
  const sim::SystemSpec spec =
      make_field({1, 0}, [](double, std::span<const double> x, std::span<double> d) {
        d[0] = x[1];
        d[1] = -4 * x[0];
      });
  for (const double tol : {1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
    INFO(tol);
    const sim::RunOptions options{.integrator = {"bdf", {{"tol", tol}}}, .dt = 0.05};
    const Judged found = judged(spec, options, 400, 400);
    sim::Registry registry = make_registry();
    sim::Simulation again(spec, registry, options);
    double error = 0;
    for (int n = 1; n <= 400; ++n) {
      REQUIRE(again.step());
      const double t = again.t();
      error = std::max({error, std::abs(again.component(0) - std::cos(2 * t)),
                        std::abs(again.component(1) + 2 * std::sin(2 * t))});
    }
    CHECK(found.deviation.error > error / 2);
    CHECK(found.deviation.error < 5 * error);
  }
}
