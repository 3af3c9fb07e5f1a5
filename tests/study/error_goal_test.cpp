// An error that is asked for: what is chosen keeps it, by closed forms and by tight runs of another
// family, and says so where nothing can.
#include "core/study/accuracy/error_goal.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/study/accuracy/trajectory.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::ErrorGoal;
using sim::study::GoalChoice;

namespace {

sim::study::Watch no_watch() {
  return [](std::string_view, double) { return true; };
}

GoalChoice choice_of(const sim::SystemSpec& spec, const ErrorGoal& goal) {
  sim::Registry registry = make_registry();
  return sim::study::choose_for_error({&spec, &registry}, goal, no_watch());
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

// x' = sigma (y - x) and so on: Lorenz (1963).
sim::SystemSpec make_chaos() {
  sim::SystemSpec spec;
  spec.name = "lorenz";
  const sim::OdeFunction f = [](double, std::span<const double> x, std::span<double> dxdt) {
    dxdt[0] = 10 * (x[1] - x[0]);
    dxdt[1] = x[0] * (28 - x[2]) - x[1];
    dxdt[2] = x[0] * x[1] - 8.0 / 3 * x[2];
  };
  spec.first_order = sim::FirstOrderSpec{1, {1, 1, 1}, make_part("lua", {{"f", f}})};
  spec.integrator = "rk4";
  spec.dt = 0.01;
  return spec;
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

  CHECK_THROWS(choice_of(make_chaos(),
                         {.budget = {1e-3, false}, .time = 1, .integrators = {{"verlet", {}}}}));
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
  const GoalChoice choice = choice_of(make_chaos(), {.budget = {1e-2, false}, .time = 60});
  REQUIRE(choice.method);
  CHECK_FALSE(choice.kept);
  CHECK(choice.chaotic);
  // Roundings of 1e-16 grow by e^0.906 a second (Sprott 2003): to 1e-2 within some 36 s.
  CHECK(choice.horizon > 20);
  CHECK(choice.horizon < 50);
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
