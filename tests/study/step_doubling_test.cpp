// A run and its shadow: how far they part is how wrong the run is.
#include "core/study/verdict/step_doubling.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/study/accuracy/reference.h"
#include "core/study/energy_balance.h"
#include "core/study/verdict/criterion.h"
#include "core/study/verdict/refined_run.h"
#include "core/study/verdict/verdict.h"
#include "tests/lua/scene_text.h"
#include "tests/study/judged_run.h"
#include "tests/support/bouncing_ball.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::RunDeviation;
using sim::study::Trust;
using sim::study::Verdict;

TEST_CASE(
    "what a refined run is compared by are the coordinates of all particles, or all numbers") {
  sim::Registry registry = sim_test::make_registry();
  for (const int n : {1, 3, 4}) {
    sim::Simulation cloth(sim_test::make_cloth(n + 1), registry,
                          {.integrator = {"rk4"}, .dt = 0.01});
    for (int i = 0; i < 5; ++i) REQUIRE(cloth.step());
    const std::vector<double> x = sim::study::positions(cloth);
    REQUIRE(x.size() == 3 * static_cast<std::size_t>(cloth.particles()));
    for (int i = 0; i < cloth.particles(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        CHECK(x[static_cast<std::size_t>(3 * i + axis)] == cloth.position(i)[axis]);
  }
  sim::Simulation circle(sim_test::make_circle(), registry, {.integrator = {"rk4"}, .dt = 0.01});
  REQUIRE(circle.step());
  CHECK(std::ranges::equal(sim::study::positions(circle), circle.state()));
}

// The jump of van der Pol's oscillator comes a little earlier or later: that is no chaos.
TEST_CASE("neighbours that part for a moment are not chaotic") {
  const sim::SystemSpec jumps =
      make_field({2, 0}, [](double, std::span<const double> x, std::span<double> d) {
        d[0] = x[1];
        d[1] = 100 * (1 - x[0] * x[0]) * x[1] - x[0];
      });
  const Judged loose = judged(jumps, {.integrator = {"esdirk43", {{"tol", 1e-3}}}, .dt = 1}, 250);
  CHECK(loose.verdict.trust != Trust::kChaotic);
  CHECK_FALSE(loose.deviation.growth > 1e5);
  const Judged lorenz = judged(make_lorenz(), {.integrator = "rk4", .dt = 0.01}, 4000);
  CHECK(lorenz.verdict.trust == Trust::kChaotic);
  CHECK(lorenz.deviation.growth > 1e5);
}

TEST_CASE("neighbours that part at once do so in words that are numbers") {
  sim::Registry registry = make_registry();
  const sim::Simulation system(make_elastic_pendulum(), registry);
  RunDeviation deviation;
  deviation.outcome = RunDeviation::Outcome::kCompared;
  deviation.share = 1;
  deviation.growth = 1e7;
  deviation.horizon = 0.02;
  deviation.rate = 1e300;
  CHECK(finding_of(deviation, system).words ==
        "positions are right until about t = 0.02 s (neighbours part tenfold within 0.0033 s)");
  deviation.rate = 2.5;
  CHECK(finding_of(deviation, system).words.find("part by x2.5 a second") != std::string::npos);
}

// Loose tolerances and single precision make motions of 1e-8 of the size from roundings.
TEST_CASE("what is at rest but for roundings is not doubted") {
  sim::SystemSpec rest = make_row();
  for (sim::ParticleSpec& each : rest.particles->list) each.position += sim::Vec3(0.1, 0.2, 0.3);
  const sim::RunOptions loose{.integrator = {"tsit5", {{"tol", 2e-6}}}, .dt = 0.16};
  const sim::RunOptions single{.integrator = {"verlet", {{"precision", std::string("single")}}},
                               .dt = 0.01};
  for (const sim::RunOptions& options : {loose, single}) {
    const Judged found = judged(rest, options, 60);
    INFO(options.integrator.name << ' ' << found.verdict.reason);
    CHECK(found.verdict.trust == Trust::kTrusted);
    CHECK(found.deviation.error < 1e-5);
  }
  // Moving particles are compared as before.
  rest.particles->list[5].velocity = {1, 0, 0};
  sim::RunOptions coarse = loose;
  coarse.integrator.given["tol"] = 1e-2;
  CHECK(judged(rest, coarse, 60).verdict.trust == Trust::kSuspect);
}

TEST_CASE("the shadow tells the error of methods of every order") {
  for (const auto& [method, h] : {std::pair{"euler", 0.001},
                                  {"midpoint", 0.02},
                                  {"rk3", 0.05},
                                  {"rk4", 0.1},
                                  {"implicit_midpoint", 0.02},
                                  {"trbdf2", 0.02}}) {
    INFO(method);
    const auto steps = static_cast<std::int64_t>(std::round(20 / h));
    const Judged found = judged(make_oscillator(), {.integrator = method, .dt = h}, steps);
    sim::Registry registry = make_registry();
    sim::Simulation again(make_oscillator(), registry, {.integrator = method, .dt = h});
    double error = 0;
    for (std::int64_t n = 0; n < steps; ++n) {
      REQUIRE(again.step());
      error = std::max({error, std::abs(again.component(0) - std::cos(again.t())),
                        std::abs(again.component(1) + std::sin(again.t()))});
    }
    REQUIRE(found.deviation.verified());
    CHECK(found.deviation.error == Approx(error).epsilon(0.1));
  }
}

// Balls that bounce on a plane. Contact at the ends of steps has order 1, though the method has 2.
// One ball alone may meet the plane at the same time with half the step.
TEST_CASE("the error that is told of a run with contact is that of the order it has") {
  constexpr double kRestitution = 0.8, kEnd = 1.7;
  const std::vector<double> heights{1, 0.87, 0.71, 0.62, 0.53, 0.49};
  sim::PartSpec plane = make_part("plane", {{"normal", sim::Vec3(0, 1, 0)}});
  plane.given["restitution"] = kRestitution;
  sim::SystemSpec spec = make_particle({0, heights[0], 0}, {0, 0, 0}, plane);
  for (std::size_t i = 1; i < heights.size(); ++i)
    spec.particles->list.push_back({.position = {0.2 * double(i), heights[i], 0}, .mass = 1});
  spec.accuracy = sim::Accuracy::kProject;
  int runs = 0;
  for (double h = 0.0011; h < 0.012; h *= 1.13) {
    const auto steps = static_cast<std::int64_t>(kEnd / h);
    const Judged found = judged(spec, {.integrator = "verlet", .dt = h}, steps);
    sim::Registry registry = make_registry();
    sim::Simulation again(spec, registry, {.integrator = "verlet", .dt = h});
    double error = 0;
    for (std::int64_t n = 0; n < steps; ++n) {
      REQUIRE(again.step());
      if (n % std::max<std::int64_t>(1, steps / 100) != 0) continue;
      for (std::size_t i = 0; i < heights.size(); ++i)
        error = std::max(error, std::abs(again.position(static_cast<int>(i))[1] -
                                         bouncing_height(heights[i], again.t(), kRestitution)));
    }
    INFO(h << ": told " << found.deviation.error << ", true " << error);
    CHECK(found.deviation.error > 2.0 / 3 * error);
    CHECK(found.deviation.error < 8 * error);
    ++runs;
  }
  CHECK(runs >= 19);
}

// The run with half the step is right by chance wherever one with twice the step ends, but not in
// between.
TEST_CASE("a bouncing ball that half the step repeats by chance is not doubted") {
  sim::PartSpec plane = make_part("plane", {{"normal", sim::Vec3(0, 1, 0)}});
  plane.given["restitution"] = 0.8;
  const sim::SystemSpec spec = make_particle({0, 1, 0}, {0, 0, 0}, plane);
  const Judged found = judged(spec, {.integrator = "implicit_midpoint", .dt = 0.1}, 60);
  CHECK(found.deviation.error > 1e-4);
  CHECK(found.deviation.error < 0.02);
}

// A particle at 1 m/s leaves the edge of a table after 0.6 s and falls. Steps of which the last
// before that ends late leave it when halves and quarters of them do.
TEST_CASE("what slides off an edge does so at the ends of steps, and the error tells") {
  constexpr double kEnd = 1;
  const sim::PartSpec table =
      make_part("box", {{"center", sim::Vec3(0, 0.4, 0)}, {"half", sim::Vec3(0.6, 0.1, 0.6)}});
  const sim::SystemSpec spec = make_particle({0, 0.5, 0}, {1, 0, 0}, table);
  for (const double h : {0.6 / 49.9, 0.6 / 49.8, 0.6 / 20.85, 0.6 / 20.4})
    for (const char* method : {"verlet", "rk4", "pefrl"}) {
      const auto steps = static_cast<std::int64_t>(kEnd / h);
      const Judged found = judged(spec, {.integrator = method, .dt = h}, steps);
      sim::Registry registry = make_registry();
      sim::Simulation again(spec, registry, {.integrator = method, .dt = h});
      REQUIRE(run(again, steps));
      const double fallen = again.t() - 0.6;
      const double error = std::abs(again.position(0)[1] - 0.5 + 0.5 * kGravity * fallen * fallen);
      INFO(method << ' ' << h << ": told " << found.deviation.error << ", true " << error);
      CHECK(error > 1e-3);
      CHECK(found.deviation.error > 2.0 / 3 * error);
      CHECK(found.deviation.error < 30 * error);
    }
}

// Euler's method swings a pendulum up. The two are far apart long before the end.
TEST_CASE("a run that is in doubt is followed no further, beside it or behind it") {
  const sim::RunOptions options{.integrator = "euler", .dt = 0.01};
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_elastic_pendulum();
  const auto compared = [&](bool beside, bool early) {
    sim::Simulation system(spec, registry, options);
    sim::study::StepDoubling shadow(spec, system, 2000, registry);
    for (int n = 0; n <= 2000; ++n) {
      if (n > 0) REQUIRE(system.step());
      const sim::Energy energy = system.energy();
      if (n % 20 == 0) shadow.look(&energy);
      if (beside && n == 200) REQUIRE(shadow.follow_beside([] { return false; }, early));
    }
    RunDeviation result = shadow.compare([] { return false; }, {.early = early});
    const sim::study::Finding found = finding_of(result, system);
    CHECK(found.trust == Trust::kSuspect);
    CHECK((found.words.find(" already, ") != std::string::npos) == early);
    return result;
  };
  const RunDeviation whole = compared(false, false), early = compared(false, true);
  CHECK(whole.until == HUGE_VAL);
  CHECK(early.verified());
  CHECK(early.until < 15);
  CHECK(early.at_end > 0.2 * 0.8);  // of the size at the start, 1 m or so
  CHECK(early.horizon == whole.horizon);
  const RunDeviation beside = compared(true, true);
  CHECK(beside.until == early.until);
  CHECK(beside.error == early.error);
}

// A dashpot makes verlet evaluate forces four times a step. Half the step, and twice the step for
// the order, take two and a half times the run.
TEST_CASE("a method that evaluates forces several times a step is refined by half the step") {
  sim::Registry registry = make_registry();
  const sim::SceneSpec scene = sim::test::load_text(
      "local calls = 0\nlocal p = sim.particles { mass = 1 }\np:add {0, 0, 0}\np:add {0, -1, 0}\n"
      "p:prescribe(0, function(t) calls = calls + 1 return {0.1 * math.sin(t), 0, 0} end)\n"
      "return sim.scene { particles = p, integrator = 'verlet', dt = 0.01, duration = 3,\n"
      "forces = { sim.force.gravity {}, sim.force.spring { stiffness = 50, damping = 1,\n"
      "  ties = { {0, 1} } } }, observe = { calls = function() return calls end } }\n");
  const sim::SystemSpec& spec = scene.systems[0];
  sim::Simulation system(spec, registry, {});
  const auto calls = [&] { return spec.observers[0].value(system); };
  sim::study::StepDoubling shadow(spec, system, 300, registry);
  const double before = calls();
  for (int n = 0; n <= 300; ++n) {
    if (n > 0) REQUIRE(system.step());
    const sim::Energy energy = system.energy();
    shadow.look(&energy);
  }
  const double run = calls() - before;
  const RunDeviation deviation = shadow.compare([] { return false; });
  const double comparison = calls() - before - run;
  REQUIRE(system.integrator().effort().evaluations == 1200);
  CHECK(comparison > 2 * run);
  constexpr double kLooks = 20'000, kEnds = 2 * 300;  // at the path between the steps, for pulses
  CHECK(comparison < 3 * run + kLooks + kEnds);
  CHECK(deviation.outcome == RunDeviation::Outcome::kCompared);
  CHECK(deviation.error < 1e-3);
}

TEST_CASE("a comparison that is stopped tells until when positions are known") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_elastic_pendulum();
  sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = 0.001});
  sim::study::StepDoubling shadow(spec, system, 1000, registry);
  for (int n = 0; n <= 1000; ++n) {
    if (n > 0) REQUIRE(system.step());
    const sim::Energy energy = system.energy();
    if (n % 10 == 0) shadow.look(&energy);
  }
  int asked = 0;
  const RunDeviation part = shadow.compare([&] { return ++asked > 300; });
  CHECK(part.outcome == RunDeviation::Outcome::kStopped);
  CHECK(part.until > 0);
  CHECK(part.until < 1);
  CHECK(part.error < 1e-5);
  const sim::study::Finding found = finding_of(part, system);
  CHECK(found.trust == Trust::kTrusted);  // so far: a track makes it unverified
  CHECK(found.words.find(" m until t = ") != std::string::npos);
}

// The run with shifted steps begins when the one with half of them is over.
TEST_CASE("a comparison that is stopped between its runs knows nothing from t = 0 on") {
  sim::Registry registry = make_registry();
  sim::PartSpec plane = make_part("plane", {{"normal", sim::Vec3(0, 1, 0)}});
  plane.given["restitution"] = 0.8;
  sim::SystemSpec spec = make_particle({0, 1, 0}, {0, 0, 0}, plane);
  spec.accuracy = sim::Accuracy::kProject;
  for (const auto& [h, trust] : {std::pair(0.002, Trust::kTrusted), {0.05, Trust::kSuspect}}) {
    const auto steps = static_cast<int>(0.8 / h);
    sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = h});
    sim::study::StepDoubling shadow(spec, system, steps, registry);
    for (int n = 0; n <= steps; ++n) {
      if (n > 0) REQUIRE(system.step());
      const sim::Energy energy = system.energy();
      if (n % std::max(1, steps / 100) == 0) shadow.look(&energy);
    }
    int all = 0, untold = 0;
    shadow.compare([&] { return ++all < 0; });
    for (int most = 1; most < all; ++most) {
      int asked = 0;
      const RunDeviation part = shadow.compare([&] { return ++asked > most; });
      const sim::study::Finding found = finding_of(part, system);
      INFO(h << ' ' << most << " of " << all << ' ' << found.words);
      if (part.outcome == RunDeviation::Outcome::kStopped && part.until < HUGE_VAL)
        CHECK(part.until > 0);
      if (found.words.empty()) ++untold;
      if (most > 0.9 * all) CHECK(found.trust == trust);
    }
    CHECK(untold > 0);
    CHECK(untold < all);
  }
}

TEST_CASE("the shadow of an adaptive run has a tenth of its tolerance") {
  for (const double tol : {1e-3, 1e-6}) {
    sim::RunOptions options{.integrator = "dopri5", .dt = 0.1};
    options.integrator.given["tol"] = tol;
    const Judged found = judged(make_oscillator(), options, 200);
    sim::Registry registry = make_registry();
    sim::Simulation again(make_oscillator(), registry, options);
    double error = 0;
    for (int n = 0; n < 200; ++n) {
      REQUIRE(again.step());
      error = std::max(error, std::abs(again.component(0) - std::cos(again.t())));
    }
    CHECK(found.deviation.error > 0.5 * error);
    CHECK(found.deviation.error < 3 * error);
  }
}

// Two particles of 0.25 kg on a spring of 400 N/m swing at sqrt(3200) 1/s; each state of the run
// has the spring at rest, those of the shadow in between have not.
TEST_CASE("a strain between the states of an adaptive run is seen, of any pair of particles") {
  const double rate = std::sqrt(3200.0), amplitude = 0.2 * 0.25;
  for (const std::size_t first : {0, 1}) {
    std::vector<sim::Vec3> points{{0, 0, 0}, {0.25, 0, 0}};
    if (first == 1) points.insert(points.begin(), {0, 9, 0});
    sim::SystemSpec spec = make_chain(points, {}, 0);
    spec.forces.back().elements = {};
    spec.forces.back().elements.add({static_cast<int>(first), static_cast<int>(first) + 1},
                                    {{"rest", 0.25}});
    spec.particles->list[first + 1].velocity.x() = rate * amplitude;
    const Judged found = judged(spec, {.integrator = "dopri5", .dt = M_PI / rate}, 40);
    INFO(first);
    CHECK(found.deviation.strain.a == static_cast<int>(first));
    CHECK(found.deviation.strain.b == static_cast<int>(first) + 1);
    CHECK(std::fabs(found.deviation.strain.strain) == Approx(0.2).epsilon(0.05));
    CHECK(std::fabs(found.verdict.figures.strain.strain) == Approx(0.2).epsilon(0.05));
  }
}

TEST_CASE("a phase that is lost slowly is found although every step is good") {
  const Judged found = judged(make_elastic_pendulum(), {.integrator = "verlet", .dt = 0.01}, 40000);
  CHECK(found.verdict.figures.step_error < 1e-3);
  CHECK(found.verdict.figures.energy < 0.01);
  CHECK(found.verdict.trust != Trust::kTrusted);
  CHECK(
      judged(make_elastic_pendulum(), {.integrator = "verlet", .dt = 0.001}, 2000).verdict.trust ==
      Trust::kTrusted);
}

TEST_CASE("chaos is told from error, with the time until which positions are right") {
  const Judged found = judged(make_lorenz(), {.integrator = "rk4", .dt = 0.01}, 3000);
  INFO(found.verdict.reason);
  CHECK(found.verdict.trust == Trust::kChaotic);
  CHECK(found.deviation.horizon > 10);
  CHECK(found.deviation.horizon < 25);
  // The largest Lyapunov exponent is 0.9056: Sprott, Chaos and Time-Series Analysis (2003), 5.6.
  CHECK(std::log(found.deviation.rate) == Approx(0.9056).margin(0.35));
  CHECK(judged(make_lorenz(), {.integrator = "rk4", .dt = 0.01}, 500).verdict.trust ==
        Trust::kTrusted);
  // Error without chaos.
  const Judged wrong = judged(make_oscillator(), {.integrator = "euler", .dt = 0.05}, 400);
  CHECK(wrong.verdict.trust == Trust::kSuspect);
  CHECK(wrong.deviation.growth < 100);
}

// Twice as long as at rest, it reaches its hook with no speed left: on which side it comes out no
// step knows, however good its estimate.
TEST_CASE("a spring that is pressed to a point is looked at closely") {
  const auto pendulum = [](double share, double kick) {
    sim::SystemSpec spec;
    spec.name = "pressed";
    spec.integrator = "rk4";
    spec.dt = 0.01;
    spec.particles.emplace();
    const sim::Vec3 away(0.20652625600744456, -1, 0.21009100247848916);
    spec.particles->list = {{.position = {0, 0, 0}, .mass = 1},
                            {.position = away, .velocity = -kick * away, .mass = 1}};
    spec.particles->pinned = {0};
    sim::PartSpec spring = make_springs("spring", 1);
    spring.elements.add({0, 1}, {{"rest", share * away.norm()}});
    spec.forces.push_back(std::move(spring));
    return spec;
  };
  const sim::SystemSpec still = pendulum(0.5, 0);
  for (const auto& [method, h] :
       {std::pair{"verlet", 0.005}, {"pefrl", 0.06}, {"rk4", 0.01}, {"implicit_midpoint", 0.007}}) {
    const Judged found = judged(still, {.integrator = method, .dt = h},
                                static_cast<std::int64_t>(std::round(7 / h)));
    INFO(method << ' ' << found.verdict.reason);
    CHECK(found.verdict.trust != Trust::kTrusted);
  }
  const Judged loose = judged(still, {.integrator = {"tsit5", {{"tol", 0.0147}}}, .dt = 0.09}, 53);
  INFO(loose.verdict.reason);
  CHECK(loose.verdict.trust != Trust::kTrusted);
  // With speed to spare it comes out on the other side, and nobody doubts it.
  const Judged fast = judged(pendulum(0.5, 1), {.integrator = "verlet", .dt = 1e-3}, 5000);
  INFO(fast.verdict.reason);
  CHECK(fast.verdict.trust == Trust::kTrusted);
}

// At first it is off by as much as it has moved.
TEST_CASE("the error of a single particle is a share of its whole way") {
  sim::SystemSpec spec = make_falling(1, 0);
  const Judged found = judged(spec, {.integrator = "implicit_euler", .dt = 1e-3}, 1000);
  INFO(found.verdict.reason);
  // It falls by g (t^2 + h t) / 2, and comes 2.94 m far.
  CHECK(found.deviation.share == Approx(0.5 * kGravity * 1e-3 / 2.94).epsilon(0.02));
  CHECK(found.verdict.trust == Trust::kTrusted);
}

TEST_CASE("growth of the system itself is not held against the method") {
  const auto growth =
      make_field({1}, [](double, std::span<const double> x, std::span<double> d) { d[0] = x[0]; });
  CHECK(judged(growth, {.integrator = "rk4", .dt = 0.001}, 1000).verdict.trust == Trust::kTrusted);
}

TEST_CASE("few steps are compared with many, not with twice as few") {
  const auto driven =
      make_field({0, 1}, [](double t, std::span<const double> x, std::span<double> d) {
        d[0] = x[1];
        d[1] = -4 * x[0] - 0.1 * x[1] + std::sin(7 * t);
      });
  CHECK(judged(driven, {.integrator = "implicit_euler", .dt = 3}, 5).verdict.trust ==
        Trust::kSuspect);
}

TEST_CASE("single precision is compared with double precision") {
  sim::RunOptions options{.integrator = "rk4", .dt = 0.001};
  options.integrator.given["precision"] = std::string("single");
  const Judged found = judged(make_row(1, 0.1), options, 2000);
  CHECK(found.deviation.error > 1e-8);  // in double precision it is 1e-11
  CHECK(found.deviation.error < 1e-3);
}

TEST_CASE("what cannot be verified is not called verified") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_oscillator();
  sim::Simulation system(spec, registry);
  sim::study::StepDoubling shadow(spec, system, 10, registry);
  shadow.look(nullptr);
  REQUIRE(run(system, 10));
  shadow.look(nullptr);
  CHECK(shadow.compare([] { return true; }).outcome == RunDeviation::Outcome::kStopped);
  const sim::RunOptions adaptive{.integrator = "dopri5", .dt = 0.1};
  sim::Simulation free(spec, registry, adaptive);
  sim::study::Monitor monitor(spec, free, 10, &registry);
  const Verdict nothing = monitor.verdict();
  CHECK(nothing.trust == Trust::kSuspect);
  CHECK(nothing.reason.find("not verified") != std::string::npos);
}

// P = t^3 is integrated exactly by the cubic through four looks, wherever they are.
TEST_CASE("work is integrated by cubics") {
  sim::study::WorkIntegral work;
  for (const double t : {0.0, 0.3, 0.4, 1.1, 1.2, 1.9, 2.0}) work.look(t, t * t * t);
  CHECK(work.value() == Approx(4).epsilon(1e-14));
  CHECK(work.with(3, 27) == Approx(81.0 / 4).epsilon(1e-14));
  CHECK(work.uncertainty() > 0);
  CHECK(std::isinf(sim::study::WorkIntegral().uncertainty()));
  // The uncertainty is the error of parabolas: on t^3 a quarter of h^4 a piece from the fourth
  // look.
  sim::study::WorkIntegral even;
  for (int k = 0; k <= 10; ++k) even.look(k, double(k) * k * k);
  CHECK(even.uncertainty() == Approx(2 * 8 * 0.25).epsilon(1e-12));
}

TEST_CASE("a shadow that follows on a thread of its own finds what one finds afterwards") {
  sim::SystemSpec spec = make_cloth(8);
  spec.observers = {{"low", [](const sim::Simulation& s) { return s.position(60).y(); }}};
  for (const char* method : {"verlet", "rk4", "tsit5", "trbdf2"}) {
    CAPTURE(method);
    const sim::RunOptions options{.integrator = method, .dt = 0.004};
    const RunDeviation after = judged(spec, options, 300).deviation;
    for (const std::int64_t from : {0, 150, 299}) {
      const RunDeviation beside = judged(spec, options, 300, 100, from).deviation;
      CHECK(beside.verified());
      CHECK(beside.error == after.error);
      CHECK(beside.at_end == after.at_end);
      CHECK(beside.share == after.share);
      CHECK(beside.energy == after.energy);
      CHECK(beside.pinch.margin == after.pinch.margin);
      REQUIRE(beside.observed.size() == 1);
      CHECK(beside.observed[0].most == after.observed[0].most);
      CHECK(beside.observed[0].at_end == after.observed[0].at_end);
      CHECK(after.observed[0].most > 0);
    }
  }
}

namespace {

constexpr double kG = 9.81, kOmega = 10;

// A bead of 1 kg on a spring that bears 1.9 times its weight, let go where the spring is relaxed.
sim::SystemSpec make_breaking_bead() {
  return sim::test::load_text(
             "local particles = sim.particles { mass = 1 }\n"
             "particles:add {0, 0, 0}\n"
             "particles:add {0, -1, 0}\n"
             "particles:pin(0)\n"
             "return sim.scene { name = 'bead', particles = particles, forces = {\n"
             "  sim.force.gravity {}, sim.force.spring { ties = { {0, 1} }, stiffness = 100,\n"
             "    rest = 1, break_force = 1.9 * 9.81 } },\n"
             "  integrator = 'rk4', dt = 0.002, duration = 1 }\n")
      .systems[0];
}

// When its force m g (1 - cos(w t)) is what the spring bears; and its height from then on, a throw.
const double kBreaks = std::acos(-0.9) / kOmega;
double height_of_bead(double t) {
  const double amplitude = kG / (kOmega * kOmega);
  const double y = -1 - 1.9 * amplitude, v = -amplitude * kOmega * std::sin(kOmega * kBreaks);
  return y + v * (t - kBreaks) - 0.5 * kG * (t - kBreaks) * (t - kBreaks);
}

}  // namespace

// The moment is after 133.6 steps and the spring breaks at the end of the 134th, which is an end of
// steps of twice and of half the length, too.
TEST_CASE("a late break that finer steps repeat is not taken for right", "[breaking]") {
  for (const char* method : {"rk4", "verlet", "dopri5", "implicit_midpoint"})
    for (const double steps : {133.6, 133.2, 134.4, 268.7}) {
      CAPTURE(method, steps);
      const sim::SystemSpec spec = make_breaking_bead();
      const double h = kBreaks / steps;
      const auto count = static_cast<std::int64_t>(1 / h);
      sim::Registry registry = make_registry();
      sim::Simulation system(spec, registry, {.integrator = method, .dt = h});
      for (std::int64_t n = 0; n < count; ++n) REQUIRE(system.step());
      const double off = std::abs(system.position(1).y() - height_of_bead(system.t()));
      const Judged run = judged(spec, {.integrator = method, .dt = h}, count);
      CHECK(run.verdict.trust == Trust::kTrusted);
      CHECK(run.deviation.error >= 0.99 * off);
      // A whole step of the force that broke does as much, with some room.
      CHECK(run.deviation.error < 2.5 * 1.9 * kG * h * (1 - kBreaks));
    }
}

TEST_CASE("a reference knows when ties break to the length of its steps", "[breaking]") {
  const sim::SystemSpec spec = make_breaking_bead();
  sim::Registry registry = make_registry();
  const sim::study::Reference reference =
      sim::study::reference({&spec, &registry}, 1, [](std::string_view, double) { return true; });
  bool late = false;
  for (std::size_t k = 0; k < reference.points.size(); ++k) {
    const double t = static_cast<double>(k) / reference.intervals();
    if (t < kBreaks + 0.01) continue;
    const double off = std::abs(reference.points[k][1] - height_of_bead(t));
    late = late || off > 1e-9;
    REQUIRE(reference.error[k] >= 0.99 * off);
    REQUIRE(reference.error[k] < 1e-2);
  }
  CHECK(late);
  // Adaptive runs break ties at the ends of steps of the scene, not of the reference.
  CHECK(reference.adaptive_intervals() <= 500);
  CHECK(reference.intervals() % reference.adaptive_intervals() == 0);
}

TEST_CASE("positions are right until a run with other steps breaks other ties", "[breaking]") {
  const sim::SystemSpec net =
      sim::test::load_text(
          "local net = sim.grid { 5, 5, du = {0.1, 0, 0}, dv = {0, 0, 0.1}, mass = 0.02 }\n"
          "net:pin(0, 24)\n"
          "local rods = sim.constraint.distance { grid = net, offsets = { {0, 1}, {1, 0} },\n"
          "  break_force = 4 }\n"
          "return sim.scene { name = 'net', particles = net, constraints = { rods },\n"
          "  forces = { sim.force.gravity { g = {1, -20, 0.5} } },\n"
          "  integrator = 'rk4', dt = 0.004, duration = 1 }\n")
          .systems[0];
  // Neither of two runs is right: they broke different springs.
  sim::Registry registry = make_registry();
  std::vector<std::vector<int>> broken;
  for (const double h : {0.004, 0.002}) {
    sim::Simulation system(net, registry, {.dt = h});
    while (system.t() < 1 - 1e-9) REQUIRE(system.step());
    broken.push_back(system.settings().broken);
  }
  REQUIRE(broken[0] != broken[1]);
  const Judged run = judged(net, {.dt = 0.004}, 250);
  CHECK(run.verdict.trust == Trust::kChaotic);
  CHECK(run.verdict.reason.find("other springs or rods break") != std::string::npos);
  CHECK(run.deviation.others_broke_at == run.deviation.horizon);
  CHECK(run.deviation.horizon < 1);
}
