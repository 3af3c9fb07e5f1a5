// Work against precision: what is recommended keeps its budget.
#include "core/study/accuracy/work_precision.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>

#include "core/study/accuracy/trajectory.h"
#include "tests/lua/scene_text.h"
#include "tests/study/judged_run.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::Point;
using sim::study::WorkPrecision;

namespace {

sim::study::Watch no_watch() {
  return [](std::string_view, double) { return true; };
}

std::unique_ptr<WorkPrecision> study_of(const sim::SystemSpec& spec,
                                        const sim::study::WorkPrecisionOptions& options) {
  sim::Registry registry = make_registry();
  return sim::study::work_precision({&spec, &registry}, options, no_watch());
}

// A chain of n beads let go from the side, as scripts/scenes/pendulum.lua.
sim::SystemSpec make_pendulum(int n, double drag) {
  std::vector<sim::Vec3> points;
  for (int i = 0; i < n; ++i) points.push_back({0.25 * i, 0, 0});
  return make_chain(points, {0}, drag);
}

std::vector<double> end_of(const sim::SystemSpec& spec, const std::string& integrator, double dt,
                           double time) {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(spec, registry, {.integrator = integrator, .dt = dt});
  REQUIRE(run(simulation, simulation.steps_for(time)));
  return sim::study::coordinates(simulation);
}

// A pinned square, and a smaller one that falls on it from 0.1 m: with its corners above its edges,
// or well inside one of its two triangles.
std::string falling_square(bool inside = false) {
  return "local p = sim.particles { mass = 1 }\nlocal triangles = {}\n"
         "for s = 0, 1 do\n"
         "  for i = 0, 3 do\n"
         "    local u, v = i % 2, 0.7 * (i // 2)\n" +
         std::string(inside ? "    if s == 1 then u, v = 0.1 + 0.2 * u, 0.1 + 0.2 * v end\n"
                            : "    if s == 1 then u = 0.5 * u end\n") +
         "    p:add { u, 0.1 * s, v }\n"
         "  end\n"
         "  triangles[#triangles + 1] = { 4 * s, 4 * s + 2, 4 * s + 1 }\n"
         "  triangles[#triangles + 1] = { 4 * s + 1, 4 * s + 2, 4 * s + 3 }\n"
         "end\n"
         "p:pin(0, 1, 2, 3)\n"
         "local squares = sim.surface { particles = p, triangles = triangles }\n"
         "return sim.scene { particles = p, forces = { sim.force.gravity {} },\n"
         "  contact = sim.contact { surfaces = { squares }, thickness = 0.01 },\n"
         "  integrator = 'rk4', dt = 0.005, duration = 0.5 }\n";
}

}  // namespace

TEST_CASE("the recommended step keeps its budget") {
  struct Case {
    const char* name;
    sim::SystemSpec spec;
    double time;
    std::vector<double> budgets;  // of the size
  };
  const std::vector<Case> cases = {{"pendulum", make_pendulum(4, 0.1), 1, {1e-3}},
                                   {"cloth", make_cloth(8), 0.5, {1e-4}},
                                   {"elastic pendulum", make_elastic_pendulum(), 2, {1e-2, 1e-6}}};
  for (const auto& [name, spec, time, budgets] : cases)
    for (const double budget : budgets) {
      INFO(name << ", budget " << budget);
      const auto study = study_of(spec, {.time = time, .budget = budget, .repeats = 0});
      REQUIRE(study->recommended.has_value());
      const Point& point = study->at(*study->recommended);
      const std::string& method = study->curves[study->recommended->curve].method.name;
      CHECK(point.rms <= study->budget);
      CHECK(study->comparable == Approx(time));
      if (point.tolerance > 0) continue;
      // Against a run of another method that has nothing to do with the study.
      const std::string other = method == "rk4" ? "verlet" : "rk4";
      const double rms = sim::study::distance(end_of(spec, method, point.dt, time),
                                              end_of(spec, other, time / 40000, time))
                             .rms;
      CHECK(rms <= study->budget);
      CHECK(rms <= 1.01 * point.rms + 1e-8);
    }
}

TEST_CASE("the front rises in cost and falls in error, and nothing beats it") {
  const auto study = study_of(make_cloth(5), {.time = 0.5, .repeats = 0});
  REQUIRE(study->front.size() > 3);
  for (std::size_t i = 1; i < study->front.size(); ++i) {
    CHECK(study->cost(study->front[i]) >= study->cost(study->front[i - 1]));
    CHECK(study->at(study->front[i]).rms < study->at(study->front[i - 1]).rms);
  }
  for (const auto& curve : study->curves)
    for (std::size_t p = 0; p < curve.points.size(); ++p)
      for (const auto place : study->front) {
        const Point& point = curve.points[p];
        if (!point.finished || point.rms <= study->yardstick.floor()) continue;
        CHECK_FALSE((point.rms < study->at(place).rms && curve.cost[p] < study->cost(place)));
      }
  // The cheapest is the one of all that are good enough with the least cost.
  double least = HUGE_VAL;
  for (const auto& curve : study->curves)
    for (std::size_t p = 0; p < curve.points.size(); ++p)
      if (curve.points[p].finished && curve.points[p].rms <= study->budget)
        least = std::min(least, static_cast<double>(curve.cost[p]));
  REQUIRE(study->cheapest.has_value());
  CHECK(study->cost(*study->cheapest) == least);
}

TEST_CASE("a reference takes account of contact of surfaces between steps") {
  const sim::SceneSpec scene = sim::test::load_text(falling_square());
  sim::Registry registry({SIM_PLUGIN_DIR});
  const sim::study::Problem problem{&scene.systems[0], &registry};
  const auto reference = sim::study::reference(problem, 0.4, no_watch());
  CHECK(reference.how.find("extrapolation") == std::string::npos);
  // The upper square lies on the lower one, which free fall would pass through by 0.7 m.
  CHECK(reference.error.back() < 0.01);
  for (std::size_t i = 0; i < 4; ++i) CHECK(reference.points.back()[3 * i + 1] > -0.01);
}

TEST_CASE("measured errors are those of the literature") {
  // 8 x 8 cloth with drag to t = 1 s: rms 1.1e-5 m for pefrl at 1/64 s, 3.0e-4 m for verlet at
  // 1/128 s at the end.
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_cloth(8);
  const sim::study::Problem problem{&spec, &registry};
  const auto reference = sim::study::reference(problem, 1, no_watch());
  CHECK(reference.error.back() < 1e-11);
  const sim::study::Yardstick yardstick{&reference, 1, 1, reference.intervals(), false, 0};
  const auto error = [&](const char* name, int steps) {
    const auto methods = sim::study::fitting_methods(problem, {{name}});
    return sim::study::measure(problem, methods[0], steps, 0, yardstick, [] { return true; })
        ->rms_end;
  };
  CHECK(error("verlet", 128) == Approx(3.0e-4).epsilon(0.05));
  CHECK(error("pefrl", 64) == Approx(1.1e-5).epsilon(0.05));
}

// States of methods with steps of their own are seen at all times of the reference, also of
// implicit ones, whose dense output is worse than their steps.
TEST_CASE("the error of a method with dense output is that between its steps") {
  constexpr double kTime = 10, kTolerance = 1e-8;
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_oscillator();
  const sim::study::Problem problem{&spec, &registry};
  const auto reference = sim::study::reference(problem, kTime, no_watch());
  const int all = reference.intervals();
  REQUIRE(all >= 60);
  const sim::study::Yardstick yardstick{&reference, kTime, 1, all, false, 0};
  for (const char* name : {"rodas4", "esdirk43", "bdf", "dopri5"}) {
    const auto methods = sim::study::fitting_methods(problem, {{name}});
    const auto point =
        sim::study::measure(problem, methods[0], 20, kTolerance, yardstick, [] { return true; });
    sim::Simulation run(spec, registry,
                        {.integrator = {name, {{"tol", kTolerance}}}, .dt = kTime / all});
    double most = 0;
    for (int k = 0; k < all; ++k) {
      REQUIRE(run.step());
      most = std::max(most, std::hypot(run.component(0) - std::cos(run.t()),
                                       run.component(1) + std::sin(run.t())) /
                                std::sqrt(2));
    }
    INFO(name << ' ' << all);
    CHECK(point->rms == Approx(most).epsilon(0.01));
  }
}

// A quantity that is 0 until then and 1 afterwards. Two references see it at the same times.
TEST_CASE("the mean of what jumps is known as well as it is sampled") {
  constexpr double kTime = 1;
  for (const double jump : {0.3, 1.0 / 3, 0.7123}) {
    sim::SystemSpec spec = make_oscillator();
    spec.observers.push_back({.name = "late", .value = [jump](const sim::Simulation& s) {
                                return s.t() < jump ? 0 : 1;
                              }});
    sim::Registry registry = make_registry();
    sim::study::Problem problem{&spec, &registry};
    problem.of.emplace(spec, "mean late");
    const auto reference = sim::study::reference(problem, kTime, no_watch());
    INFO(jump << ' ' << reference.intervals());
    CHECK(std::abs(reference.figure - (kTime - jump)) <= 1.5 * reference.error.back() + 1e-12);
    CHECK(reference.error.back() < 2 * kTime / reference.intervals());
  }
}

namespace {

// A study by hand: one fixed-step method with a stable step of 1 s, points of dt, error and cost.
struct Sample {
  double dt, error;
  std::int64_t evaluations;
};

void fill(WorkPrecision& study, const std::vector<Sample>& samples) {
  study.budget = 1e-3;
  study.reference.points.resize(21);
  study.reference.error.assign(21, 1e-12);
  study.yardstick = {.reference = &study.reference, .time = 1, .size = 1, .last = 20};
  sim::study::Curve& curve = study.curves.emplace_back();
  curve.limit = 1;
  for (const auto& [dt, error, evaluations] : samples)
    curve.points.push_back(
        {.dt = dt, .finished = true, .rms = error, .effort = {.evaluations = evaluations}});
}

}  // namespace

TEST_CASE(
    "a recommendation is the closest for little more, and keeps its distance from the stable "
    "step") {
  const std::vector<Sample> samples = {{0.9, 1e-4, 100},  {0.79, 9e-4, 200}, {0.78, 2e-4, 208},
                                       {0.51, 1e-4, 400}, {0.49, 1e-5, 500}, {0.1, 1e-6, 600}};
  WorkPrecision damped;
  fill(damped, samples);
  damped.fastest = {.omega = 1e6, .damping = 1};
  damped.time = 1;
  choose(damped);
  REQUIRE((damped.cheapest && damped.recommended));
  CHECK(damped.cheapest->point == 0);
  CHECK(damped.recommended->point == 2);  // not above 0.8 of the limit; 4 % more and closer

  WorkPrecision undamped;  // and long: half the limit
  fill(undamped, samples);
  undamped.fastest = {.omega = 1e6, .damping = 0};
  undamped.time = 1;
  choose(undamped);
  REQUIRE(undamped.recommended.has_value());
  CHECK(undamped.recommended->point == 4);
  undamped.recommended.reset();
  undamped.time = 1e-3;  // 1000 radians, not 1000 turns
  choose(undamped);
  CHECK(undamped.recommended->point == 2);
}

TEST_CASE("what a disturbance grows to ends the comparison, however good the reference") {
  WorkPrecision study;
  fill(study, {});
  CHECK(last_comparable(study) == 20);
  for (int k = 0; k <= 20; ++k) study.growth.most.push_back(std::pow(10.0, k));
  // 1e-13 10^k of the size 1 reaches a hundredth of the budget at k = 8.
  study.budget = 1.1e-3;
  CHECK(last_comparable(study) == 8);
  study.size = 10;
  CHECK(last_comparable(study) == 7);
  study.reference.error[4] = 2e-5;
  CHECK(last_comparable(study) == 3);
}

// Free fall keeps the distance of two runs to the last bits. The upper square lands after 0.14 s:
// where its corners then lie is a matter of contact.
TEST_CASE("disturbed runs know contact of surfaces between steps") {
  const sim::SceneSpec scene = sim::test::load_text(falling_square(true));
  sim::Registry registry({SIM_PLUGIN_DIR});
  const sim::study::Problem problem{&scene.systems[0], &registry};
  const auto reference = sim::study::reference(problem, 0.4, no_watch());
  const auto growth = sim::study::growth(problem, reference, 0.4, no_watch());
  REQUIRE(growth.complete);
  CHECK(growth.mean.front() == Approx(1));
  CHECK(growth.mean[6] == Approx(1).epsilon(1e-6));
  CHECK(std::abs(growth.mean.back() - 1) > 0.01);
  CHECK(growth.most.back() < 1e3);
}

TEST_CASE("a study that is compared to its end is so to the last bit of its time") {
  for (const double time : {0.03, 0.3}) {
    const auto study =
        study_of(make_elastic_pendulum(), {.time = time, .integrators = {{"rk4"}}, .repeats = 0});
    CHECK(study->comparable == time);
    CHECK_FALSE(grows_too_far(*study));
  }
}

TEST_CASE("what ends a comparison is the growth of a disturbance or the reference") {
  WorkPrecision study;
  fill(study, {});
  study.budget = 1.1e-3;
  study.growth.most.assign(21, 1.0);
  study.reference.error[9] = 1e-3;
  study.yardstick.last = last_comparable(study);
  CHECK(study.yardstick.last == 8);
  CHECK_FALSE(grows_too_far(study));
  study.growth.most[9] = 1e9;
  CHECK(grows_too_far(study));
}

TEST_CASE("a choice that is refused makes room for the next one") {
  WorkPrecision study;
  fill(study, {{0.5, 1e-4, 100}, {0.4, 9e-5, 200}, {0.3, 2e-3, 50}});
  study.fastest = {.omega = 1, .damping = 1};
  choose(study);
  REQUIRE((study.cheapest && study.recommended));
  CHECK(study.recommended->point == 0);
  const std::size_t front = study.front.size();
  study.refused.push_back(*study.recommended);
  recommend(study);
  REQUIRE((study.cheapest && study.recommended));
  CHECK(study.recommended->point == 1);
  CHECK(study.cheapest->point == 1);
  CHECK(study.front.size() == front);
  study.refused.push_back(*study.recommended);
  recommend(study);
  CHECK_FALSE((study.cheapest || study.recommended));
}

TEST_CASE("a chaotic scene is compared only as long as that makes sense") {
  const auto study = study_of(make_pendulum(10, 0), {.time = 20, .budget = 1e-3, .repeats = 0});
  CHECK(study->comparable < 20);
  CHECK(study->comparable > 0.5);
  CHECK(study->growth.most.back() > 1e6);
  for (const auto& curve : study->curves)
    for (const Point& point : curve.points)
      if (point.finished && curve.method.name == "rk4" && point.dt < 5e-3)
        CHECK(point.rms < study->size);
}

TEST_CASE("a pendulum with drag forgets where it started") {
  const auto study = study_of(make_elastic_pendulum(5), {.time = 3, .repeats = 0});
  CHECK(study->growth.most.back() < 1);
  CHECK(study->growth.mean.front() == Approx(1));
}

TEST_CASE("a budget in metres is taken as it is") {
  const auto study = study_of(make_elastic_pendulum(),
                              {.time = 1, .budget = 1e-3, .budget_in_metres = true, .repeats = 0});
  CHECK(study->budget == 1e-3);
  CHECK(study->size == Approx(std::sqrt(0.6 * 0.6 + 0.9 * 0.9 + 0.3 * 0.3)));
}

TEST_CASE("a study of work ends when told to, and keeps what it has") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_elastic_pendulum();
  for (const int most : {1, 3, 40, 60}) {
    int calls = 0;
    const auto study =
        sim::study::work_precision({&spec, &registry}, {.time = 1, .repeats = 0},
                                   [&](std::string_view, double) { return ++calls < most; });
    CHECK_FALSE(study->complete);
    for (const auto& curve : study->curves) CHECK(curve.cost.size() == curve.points.size());
  }
}
