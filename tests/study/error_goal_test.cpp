// An error that is asked for: what is chosen keeps it, by closed forms and by tight runs of another
// family, and says so where nothing can.
#include "core/study/accuracy/error_goal.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/study/accuracy/required_error.h"
#include "core/study/accuracy/trajectory.h"
#include "tests/lua/scene_text.h"
#include "tests/study/goal_choice.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::ErrorGoal;
using sim::study::GoalChoice;

namespace {

sim::SystemSpec shipped(const std::string& name) {
  return sim::test::load("scenes/" + name + ".lua").systems.front();
}

// The free coordinates at k time / 20 of a run.
std::vector<std::vector<double>> path_of(const sim::SystemSpec& spec,
                                         const sim::MethodChoice& method, double dt, double time) {
  sim::Registry registry = make_registry();
  sim::Simulation run(spec, registry, {.integrator = method, .dt = dt});
  std::vector<std::vector<double>> path;
  for (int k = 1; k <= 20; ++k) {
    while (run.t() < time * k / 20 - 0.5 * dt) REQUIRE(run.step());
    path.push_back(sim::study::coordinates(run));
  }
  return path;
}

double largest_rms(const std::vector<std::vector<double>>& a,
                   const std::vector<std::vector<double>>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    most = std::max(most, sim::study::distance(a[k], b[k]).rms);
  return most;
}

}  // namespace

TEST_CASE("a choice keeps its error, by a tight run of another family", "[study][goal]") {
  constexpr double kTime = 1;
  const sim::SystemSpec scenes[] = {make_cloth(4), make_elastic_pendulum(0.1),
                                    make_chain({{0, 0, 0}, {0.25, 0, 0}, {0.5, 0, 0}}, {0}, 0.1)};
  for (const sim::SystemSpec& spec : scenes) {
    const auto truth = path_of(spec, {"dop853", {{"tol", 1e-12}}}, kTime / 20, kTime);
    double before = HUGE_VAL;
    for (const double share : {1e-2, 1e-3, 1e-5}) {
      INFO(spec.name << ' ' << share);
      const GoalChoice choice = choice_of(spec, {.budget = {share, false}, .time = kTime});
      REQUIRE(choice.method);
      CHECK(choice.kept);
      CHECK(choice.allowed == Approx(share * choice.size));
      CHECK(choice.error <= choice.allowed);
      CHECK(choice.complete);
      const double off = largest_rms(path_of(spec, choice.integrator(), choice.dt, kTime), truth);
      CHECK(off <= 1.5 * choice.allowed);
      CHECK(off <= before);  // a smaller one is not answered by a worse run
      before = off + 1e-2 * choice.allowed;
    }
  }
}

TEST_CASE("a choice is asked for in metres, and of a quantity", "[study][goal]") {
  sim::SystemSpec spec = make_elastic_pendulum();
  const GoalChoice choice = choice_of(spec, {.budget = {1e-4, true}, .time = 1});
  CHECK(choice.allowed == 1e-4);
  CHECK(choice.kept);

  spec.observers.push_back(
      {"height", [](const sim::Simulation& system) { return system.position(0)[1]; }});
  sim::Registry registry = make_registry();
  sim::study::Problem problem{&spec, &registry};
  for (const char* of : {"height", "mean height"}) {
    INFO(of);
    problem.of = sim::study::Quantity(spec, of);
    const GoalChoice figure =
        sim::study::choose_for_error(problem, {.budget = {1e-4, true}, .time = 1}, no_watch());
    CHECK(figure.kept);
    CHECK(figure.error <= 1e-4);
    CHECK(figure.unit.empty());
  }
}

TEST_CASE("a method or a step that is given restricts the choice", "[study][goal]") {
  const sim::SystemSpec spec = make_cloth(4);
  const GoalChoice rk4 =
      choice_of(spec, {.budget = {1e-3, false}, .time = 1, .integrators = {{"rk4", {}}}});
  CHECK(rk4.method->name == "rk4");
  CHECK(rk4.candidates.size() == 1);
  CHECK(rk4.kept);

  const GoalChoice step = choice_of(spec, {.budget = {1e-3, false}, .time = 1, .dt = 0.005});
  CHECK(step.dt == 0.005);
  CHECK(step.kept);
  const GoalChoice missed = choice_of(
      spec, {.budget = {1e-9, false}, .time = 1, .integrators = {{"verlet", {}}}, .dt = 0.005});
  CHECK(missed.dt == 0.005);
  CHECK_FALSE(missed.kept);
  CHECK(missed.horizon < 1);

  CHECK_THROWS(choice_of(make_lorenz(),
                         {.budget = {1e-3, false}, .time = 1, .integrators = {{"verlet", {}}}}));
}

TEST_CASE("a scene, a method that chooses among others, or nothing requires an error",
          "[study][goal]") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_cloth(4);
  const auto required = [&](const sim::MethodChoice& named, double dt) {
    return sim::study::required_error(spec, named, dt, registry);
  };
  CHECK_FALSE(required({}, 0));
  CHECK_FALSE(required("verlet", 0));
  REQUIRE(required("auto", 0));
  CHECK_FALSE(required("auto", 0)->asked);
  CHECK(required("auto", 0)->budget.of(2) == 2e-3);
  CHECK_FALSE(required("auto", 0.01));
  CHECK_FALSE(required({"auto", {{"tol", 1e-4}}}, 0));
  // The step of a scene belongs to its own method.
  spec.integrator = "auto";
  REQUIRE(spec.dt > 0);
  CHECK_FALSE(required({}, 0));
  spec.dt = 0;
  CHECK(required({}, 0));
  CHECK_FALSE(required("rk4", 0));
  spec.integrator.given["rtol"] = 1e-6;
  CHECK_FALSE(required({}, 0));

  spec.error = sim::AllowedError{1e-2, true};
  REQUIRE(required({}, 0.01));
  CHECK(required({}, 0.01)->asked);
  CHECK(required({}, 0.01)->budget.of(2) == 1e-2);
  CHECK(required("verlet", 0)->asked);
  CHECK_FALSE(required({"dopri5", {{"tol", 1e-4}}}, 0));

  const GoalChoice chosen = choice_of(
      make_cloth(4),
      {.budget = {1e-3, false}, .time = 0.2, .integrators = {{"auto", {}}}, .asked = false});
  CHECK(chosen.candidates.size() > 3);
  CHECK_FALSE(chosen.asked);
  CHECK(chosen.method->name != "auto");
  CHECK(chosen.kept);
}

TEST_CASE("the same question has the same answer", "[study][goal]") {
  const sim::SystemSpec spec = make_cloth(4);
  const ErrorGoal goal{.budget = {1e-4, false}, .time = 0.5};
  const GoalChoice a = choice_of(spec, goal), b = choice_of(spec, goal);
  CHECK(a.method->label == b.method->label);
  CHECK(a.dt == b.dt);
  CHECK(a.error == b.error);
  CHECK(a.trials == b.trials);
}

TEST_CASE("where motions part it is said until when an error is kept", "[study][goal]") {
  const GoalChoice choice = choice_of(make_lorenz(), {.budget = {1e-2, false}, .time = 60});
  REQUIRE(choice.method);
  CHECK_FALSE(choice.kept);
  CHECK(choice.chaotic);
  // Roundings of 1e-16 grow by e^0.906 a second (Sprott 2003): to 1e-2 within some 36 s.
  CHECK(choice.horizon > 20);
  CHECK(choice.horizon < 50);
}

// Steps of 3 s and more take trbdf2 to a fixed point, whose runs agree with each other; a run that
// has lost its way by the end contradicts them at the beginning, and may not be affordable beside
// the dear ones.
TEST_CASE("a choice is checked at each time of a run", "[study][goal]") {
  for (const double time : {60.0, 200.0}) {
    const GoalChoice choice = choice_of(make_lorenz(), {.budget = {1e-1, false}, .time = time});
    INFO(time << " s");
    REQUIRE(choice.method);
    CHECK_FALSE(choice.kept);
    CHECK(choice.chaotic);
    CHECK(choice.horizon > 10);
  }
}

// A step of three numbers takes less time than an answer does, and a run has thousands of its own.
TEST_CASE("trials ask seldom whether to go on", "[study][goal]") {
  const sim::SystemSpec spec = shipped("oregonator");
  sim::Registry registry = make_registry();
  const sim::study::Problem problem{.spec = &spec, .registry = &registry};
  const auto methods = sim::study::fitting_methods(problem, {{"dopri5", {}}});
  long asked = 0;
  const sim::study::TrajectoryPlan plan{.time = 100, .intervals = 1, .steps = 1};
  const sim::study::Trajectory path =
      sim::study::run_trajectory(problem, methods.front(), plan, [&] { return ++asked > 0; });
  CHECK(path.finished);
  CHECK(path.effort.steps > 10000);
  CHECK(asked < path.effort.steps / 10);
}

// The look at 32768 numbers before them takes longer than 20 steps do.
TEST_CASE("the time of trials is theirs alone", "[study][goal]") {
  const GoalChoice choice = choice_of(shipped("gray_scott"), {.budget = {1e-2, false}, .time = 20});
  REQUIRE(choice.method);
  CHECK(choice.kept);
}

// Two trials of 270000 particles, 20 and 40 steps of rk4, are dearer than a run of 5. States are
// seen at 20 times at least.
TEST_CASE("where trials are too dear the scene's own step is tried", "[study][goal]") {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list.resize(270'000, spec.particles->list.front());
  spec.forces = {make_part("expression", {{"fx", std::string("-100*x")}})};
  spec.integrator = "rk4";
  spec.dt = 0.02;
  const auto chosen = [&](double share, bool asked) {
    return choice_of(
        spec, {.budget = {share, false}, .time = 0.1, .integrators = {{"rk4"}}, .asked = asked});
  };
  const GoalChoice choice = chosen(1e-2, true);
  CHECK(choice.from_scene);
  REQUIRE(choice.method);
  CHECK(choice.method->name == "rk4");
  CHECK(choice.dt == Approx(0.1 / 20));
  CHECK(choice.kept);
  CHECK(choice.mended == 0);
  const GoalChoice finer = chosen(1e-9, true);
  CHECK(finer.kept);
  CHECK(finer.mended == 1);
  CHECK(finer.dt < choice.dt);
  CHECK_FALSE(chosen(1e-2, false).method);
}

// Methods with long steps go past a pulse of 0.057 s, and their refined runs do, too.
TEST_CASE("methods that see what others step over are believed", "[study][goal]") {
  sim::SystemSpec spec = make_lorenz();
  const double width = 0.057, at = 3.092;
  spec.first_order = sim::FirstOrderSpec{
      1,
      {0.1, 0},
      make_part(
          "lua",
          {{"f", sim::OdeFunction([=](double t, std::span<const double> x, std::span<double> d) {
              const double s = (t - at) / width;
              d[0] = x[1];
              d[1] = -x[0] + (s > 0 && s < 1 ? 30 / width * s * s * (1 - s) * (1 - s) : 0);
            })}})};
  spec.dt = 0.429;
  const GoalChoice choice = choice_of(spec, {.budget = {1e-2, false}, .time = 6});
  REQUIRE(choice.method);
  INFO(choice.method->label << ' ' << choice.tolerance << ' ' << choice.dt);
  const auto exact = path_of(spec, {"rk4"}, 1e-4, 6);
  const auto own = path_of(spec, choice.integrator(), choice.dt, 6);
  CHECK(choice.kept);
  CHECK(largest_rms(own, exact) < 1.5 * choice.allowed);
}

// A rod that falls flat bounces on both ends and rests where they would meet the plane twice in a
// step: in steps of 0.3 s and of half of that at the same moment, 5e-3 m too early.
TEST_CASE("a run and its half steps that rest at once are not believed", "[study][goal]") {
  const sim::test::SceneFolder folder;
  const std::string file = folder.write("rod.lua", R"(local sim = require "sim"
local p = sim.particles { mass = 1 }
p:add {0, 1, 0}
p:add {1, 1, 0}
return sim.scene { particles = p, forces = { sim.force.gravity {} },
  constraints = { sim.constraint.distance { ties = { {0, 1} } } },
  colliders = { sim.collider.plane { normal = {0, 1, 0}, restitution = 0.8 } },
  integrator = "verlet", dt = 0.25, duration = 6 }
)");
  const sim::SystemSpec spec = sim::test::load(file).systems.front();
  const GoalChoice choice = choice_of(spec, {.budget = {1e-4, true}, .time = 6});
  REQUIRE(choice.method);
  CHECK(choice.kept);
  const auto path = path_of(spec, *choice.method, choice.dt, 6);
  CHECK(largest_rms(path, path_of(spec, *choice.method, choice.dt / 32, 6)) < 1.5e-4);
}

// An oscillator that a pulse of 1 N s hits, within a thousandth of a second: methods that choose
// their steps go past it, and implicit ones are too dear to tell.
TEST_CASE("a method that may go past a pulse is not believed without a check", "[study][goal]") {
  constexpr double kWidth = 1e-3, kAt = 1.2829, kTime = 6, kAllowed = 1e-3;
  sim::SystemSpec spec;
  spec.name = "pulse";
  const sim::OdeFunction f = [](double t, std::span<const double> x, std::span<double> dxdt) {
    const double s = (t - kAt) / kWidth;
    dxdt[0] = x[1];
    dxdt[1] = -x[0] + (s > 0 && s < 1 ? 30 / kWidth * s * s * (1 - s) * (1 - s) : 0);
  };
  spec.first_order = sim::FirstOrderSpec{1, {0.1, 0}, make_part("lua", {{"f", f}})};
  spec.integrator = "dopri5";
  spec.dt = 0.176;
  const auto exact = path_of(spec, {"rk4", {}}, 5e-5, kTime);
  const auto missed = [&](const GoalChoice& choice) {
    return largest_rms(path_of(spec, choice.integrator(), choice.dt, kTime), exact) / kAllowed;
  };

  const GoalChoice any = choice_of(spec, {.budget = {kAllowed, true}, .time = kTime});
  REQUIRE(any.method);
  CHECK(any.kept);
  CHECK(missed(any) < 1.5);

  const GoalChoice few =
      choice_of(spec, {.budget = {kAllowed, true},
                       .time = kTime,
                       .integrators = {{"tsit5", {}}, {"implicit_midpoint", {}}}});
  REQUIRE(few.method);
  CHECK(few.kept);
  CHECK(missed(few) < 1.5);
}

// A weight breaks its thread, at the end of the same step of both runs, 5.8 ms too late, and falls.
TEST_CASE("a horizon is not believed where a run and its half steps break a thread at once",
          "[study][goal]") {
  constexpr double kSag = 0.0981, kOmega = 10, kStrain = 0.15, kTime = 0.64, kAllowed = 4e-4;
  const sim::test::SceneFolder folder;
  const std::string file = folder.write("thread.lua", R"(local sim = require "sim"
local p = sim.particles { mass = 1 }
p:pin(p:add {0, 0, 0})
p:add {0, -1, 0}
return sim.scene { particles = p, integrator = "verlet", dt = 0.01, duration = 1,
  forces = { sim.force.gravity {},
    sim.force.spring { stiffness = 100, break_strain = 0.15, ties = { {0, 1} } } } }
)");
  const sim::SystemSpec spec = sim::test::load(file).systems.front();
  const GoalChoice choice = choice_of(
      spec,
      {.budget = {kAllowed, true}, .time = kTime, .integrators = {{"verlet", {}}}, .dt = 0.014575});
  REQUIRE(choice.method);
  CHECK_FALSE(choice.kept);
  // Its way is sag (1 - cos(omega t)) until then.
  const double broken = std::acos(1 - kStrain / kSag) / kOmega;
  CHECK(choice.horizon < broken + 2 * choice.dt);
  CHECK(choice.horizon > 0.5 * broken);
}

// A top that turns by 3.1 rad in the longest steps: verlet and its half step turn by the same wrong
// angle.
TEST_CASE("a method is not believed before another has run", "[study][goal]") {
  constexpr double kTime = 0.25;
  const sim::SystemSpec spec = shipped("top");
  const GoalChoice choice = choice_of(spec, {.budget = {1e-2, false}, .time = kTime});
  REQUIRE(choice.method);
  CHECK(choice.kept);
  INFO(choice.method->label << ' ' << choice.dt);
  const auto truth = path_of(spec, {"dop853", {{"tol", 1e-10}}}, kTime / 20, kTime);
  CHECK(largest_rms(path_of(spec, choice.integrator(), choice.dt, kTime), truth) <=
        1.5 * choice.allowed);
}

TEST_CASE("errors are seen at each step of a run that is not long", "[study][goal]") {
  const sim::SystemSpec spec = make_circle();
  sim::Registry registry = make_registry();
  const sim::study::Problem problem{&spec, &registry};
  const auto method = sim::study::fitting_methods(problem, {{"rk4"}}).front();
  const auto seen = [&](std::int64_t steps) {
    return sim::study::seen_run(problem, method, {steps, 0}, 1, [](double) { return true; })
        .points.size();
  };
  CHECK(seen(720) == 721);
  CHECK(seen(7200) == 121);
}

TEST_CASE("trials know the coarsest run that kept an error", "[study][goal]") {
  const sim::SystemSpec spec = make_circle();
  sim::Registry registry = make_registry();
  const sim::study::Problem problem{&spec, &registry};
  const auto method = sim::study::fitting_methods(problem, {{"rk4"}}).front();
  sim::study::MethodTrials trials(problem, method, 1, 24, 0, false, false);
  CHECK(trials.kept_at(1) == HUGE_VAL);
  REQUIRE(trials.refine([](double) { return true; }));
  CHECK(trials.kept_at(1) == HUGE_VAL);
  REQUIRE(trials.refine([](double) { return true; }));
  CHECK(trials.fineness() == 48);
  CHECK(trials.kept_at(4 * trials.error()) == 48);  // 16 times that before
  CHECK(trials.kept_at(40 * trials.error()) == 24);
  CHECK(trials.kept_at(0.5 * trials.error()) == HUGE_VAL);
  trials.doubt(1);
  CHECK(trials.kept_at(0.5) == HUGE_VAL);
  CHECK(trials.own_error() < 0.5);
  CHECK(trials.can_refine());
  trials.give_up();
  CHECK_FALSE(trials.can_refine());
  CHECK(std::isfinite(trials.predict(1).cost));  // what is known remains
}

TEST_CASE("a larger tolerance is tried where the first is far within the error", "[study][goal]") {
  const sim::SystemSpec spec = make_circle();
  sim::Registry registry = make_registry();
  const sim::study::Problem problem{&spec, &registry};
  const auto method = sim::study::fitting_methods(problem, {{"tsit5"}}).front();
  const auto go_on = [](double) { return true; };
  sim::study::MethodTrials trials(problem, method, 1, 1e3, 20, false, false);
  REQUIRE(trials.refine(go_on));
  CHECK_FALSE(trials.can_coarsen(1));
  REQUIRE(trials.refine(go_on));
  const double error = trials.error();
  CHECK_FALSE(trials.can_coarsen(error));
  REQUIRE(trials.can_coarsen(1));
  CHECK(trials.predict(1).fineness == 1e3);
  trials.coarsen(error, go_on);
  CHECK(trials.predict(1).fineness == 1e3);  // it was off by more
  trials.coarsen(1, go_on);
  CHECK(trials.predict(1).fineness == 1e2);
  CHECK_FALSE(trials.can_coarsen(1));  // by no more than this
  trials.doubt(1e-9);
  CHECK_FALSE(trials.can_coarsen(1));
}

TEST_CASE("the cheapest method of large errors is tried on what is of first order",
          "[study][goal]") {
  sim::SystemSpec spec = make_lorenz();
  const sim::OdeFunction decays = [](double, std::span<const double> x, std::span<double> dxdt) {
    dxdt[0] = 100 * (x[1] - x[0]), dxdt[1] = -x[1], dxdt[2] = -x[2];
  };
  spec.first_order = sim::FirstOrderSpec{1, {1, 1, 1}, make_part("lua", {{"f", decays}})};
  const auto chosen = [&](double share) {
    const GoalChoice choice = choice_of(spec, {.budget = {share, false}, .time = 1});
    REQUIRE(choice.method);
    CHECK(choice.kept);
    return choice.method->name;
  };
  CHECK(chosen(2e-2) == "euler");
  CHECK(chosen(1e-6) != "euler");
}

// With a tolerance of 1e-3 rodas4 comes to no end there; with 1e-4 it costs less than half of what
// others do.
TEST_CASE("a method that could not go on is tried with a smaller tolerance", "[study][goal]") {
  const sim::SystemSpec spec = shipped("robertson");
  const GoalChoice choice = choice_of(spec, {.budget = {1e-3, false}, .time = spec.duration});
  REQUIRE(choice.method);
  CHECK(choice.kept);
  CHECK(choice.method->name == "rodas4");
  CHECK(choice.cost < 1500);
}

// Two runs of bdf differ by 1e-5 of the state, and both are off by 4e-5.
TEST_CASE("a method that contradicts a run is refined before it is believed", "[study][goal]") {
  const sim::SystemSpec spec = shipped("hires");
  const GoalChoice choice = choice_of(spec, {.budget = {1e-5, false}, .time = spec.duration});
  REQUIRE(choice.method);
  CHECK(choice.kept);
  CHECK(choice.mended == 0);
}

// Boxes fall through the ground in steps of 0.5 and 0.25 s, and stand in shorter ones.
TEST_CASE("a run that missed the error is not predicted to keep it", "[study][goal]") {
  const sim::SystemSpec spec = shipped("stack");
  const GoalChoice choice = choice_of(spec, {.budget = {1e-3, false}, .time = spec.duration});
  REQUIRE(choice.method);
  CHECK(choice.kept);
  CHECK(choice.mended == 0);
}

// One trial of tsit5, whose steps get short where cubes lie on the ground, takes as much as all
// trials may.
TEST_CASE("a method that turns out to be dear leaves the others their trials", "[study][goal]") {
  const sim::SystemSpec spec = shipped("jelly");
  const GoalChoice choice = choice_of(spec, {.budget = {1e-2, false}, .time = spec.duration});
  REQUIRE(choice.method);
  CHECK(choice.kept);
}

TEST_CASE("a choice that is told to end says so", "[study][goal]") {
  const sim::SystemSpec spec = make_cloth(4);
  sim::Registry registry = make_registry();
  int asked = 0;
  const GoalChoice choice =
      sim::study::choose_for_error({&spec, &registry}, {.budget = {1e-5, false}, .time = 1},
                                   [&](std::string_view, double) { return ++asked < 5; });
  CHECK_FALSE(choice.complete);
  CHECK_FALSE(choice.method);
}

// A run of up to 1e5 evaluations of 64 particles is tried whole; of a longer one a half, a quarter,
// .. that is no longer, but no less than a 64th. Told to end at once, it has tried nothing.
TEST_CASE("trials take as much of a run as is cheap", "[study][goal]") {
  sim::Registry registry = make_registry();
  const auto share = [&](const sim::SystemSpec& spec, const char* method, double evaluations) {
    constexpr double kEach = 0.01;
    sim::SystemSpec given = spec;
    given.integrator = method;
    given.dt = kEach;
    const ErrorGoal goal{.budget = {1e-2, false}, .time = evaluations * kEach};
    const GoalChoice choice = sim::study::choose_for_error(
        {&given, &registry}, goal, [](std::string_view, double) { return false; });
    CHECK_FALSE(choice.complete);
    CHECK(choice.time == goal.time);
    return choice.window / choice.time;
  };
  const sim::SystemSpec one = make_elastic_pendulum();
  CHECK(share(one, "verlet", 0.99e5) == 1);
  CHECK(share(one, "verlet", 1.01e5) == 0.5);
  CHECK(share(one, "verlet", 1.99e5) == 0.5);
  CHECK(share(one, "rk4", 1.01e5) == 0.125);  // four a step
  CHECK(share(one, "verlet", 63e5) == 1.0 / 64);
  CHECK(share(one, "verlet", 1e9) == 1.0 / 64);
  CHECK(share(make_cloth(16), "verlet", 0.99e5) ==
        Approx(share(make_cloth(8), "verlet", 0.99e5) / 4));  // four times the particles
  sim::SystemSpec flat = make_lorenz();
  CHECK(share(flat, "rk4", 0.99e5 / 4) == 1);
  const sim::OdeFunction still = [](double, std::span<const double>, std::span<double> dxdt) {
    std::ranges::fill(dxdt, 0.0);
  };
  flat.first_order =
      sim::FirstOrderSpec{1, std::vector<double>(3 * 128, 1), make_part("lua", {{"f", still}})};
  CHECK(share(flat, "rk4", 0.99e5 / 4) == 0.5);
}

// The states are as many as the scene has steps, in multiples of 120, but 40 of an implicit method
// where there is contact: each ends a step there.
TEST_CASE("methods of own steps show states at the steps that are asked for", "[study][goal]") {
  sim::SystemSpec spec = make_elastic_pendulum(0.1);
  const auto states = [&](const char* method, double own, double asked) {
    sim::SystemSpec given = spec;
    given.dt = own;
    const GoalChoice choice = choice_of(
        given, {.budget = {1e-2, false}, .time = 1, .integrators = {{method, {}}}, .dt = asked});
    REQUIRE(choice.method);
    CHECK(choice.tolerance > 0);
    CHECK(std::get<double>(choice.integrator().given.at("tol")) == choice.tolerance);
    return 1 / choice.dt;
  };
  CHECK(states("dopri5", 0.005, 0) == Approx(240));
  CHECK(states("dopri5", 1.0 / 120, 0) == Approx(120));
  CHECK(states("dopri5", 1.0 / 121, 0) == Approx(240));
  CHECK(states("dopri5", 0.5, 0) == Approx(120));
  CHECK(states("dopri5", 0.5, 0.002) == Approx(600));
  CHECK(states("esdirk43", 0.005, 0) == Approx(240));
  spec.colliders = {
      make_part("plane", {{"normal", sim::Vec3(0, 1, 0)}, {"point", sim::Vec3(0, -10, 0)}})};
  CHECK(states("dopri5", 0.005, 0) == Approx(240));
  CHECK(states("esdirk43", 0.005, 0) == Approx(40));
  CHECK(states("esdirk43", 0.005, 0.005) == Approx(240));
}

// x = cos t + 2 over half a turn, from 3 to 1, whose mean is 2.
TEST_CASE("an error of a quantity is a share of its range, or of its size where it has none",
          "[study][goal]") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_circle();
  const auto seen = [](double factor, double offset) {
    return [=](const sim::Simulation& system) { return factor * system.position(0)[0] + offset; };
  };
  spec.observers = {
      {"x", seen(1, 2)}, {"back", seen(-1, -2)}, {"three", seen(0, -3)}, {"nothing", seen(0, 0)}};
  sim::study::Problem problem{&spec, &registry};
  const auto size = [&](const char* of) {
    problem.of = sim::study::Quantity(spec, of);
    const GoalChoice choice = sim::study::choose_for_error(
        problem, {.budget = {1e-3, false}, .time = std::acos(-1.0)}, no_watch());
    CHECK(choice.allowed == Approx(1e-3 * choice.size));
    CHECK(choice.unit.empty());
    CHECK(choice.kept);
    CHECK_FALSE(choice.chaotic);
    return choice.size;
  };
  CHECK(size("x") == Approx(2).epsilon(1e-2));
  CHECK(size("back") == Approx(2).epsilon(1e-2));
  CHECK(size("mean x") == Approx(2).epsilon(1e-2));
  CHECK(size("mean back") == Approx(2).epsilon(1e-2));
  CHECK(size("three") == 3);
  CHECK(size("nothing") == 1);
}
