// The cost of a choice for an error: that of its candidates, its trials and its checks.
#include <catch2/catch.hpp>

#include "core/study/accuracy/error_goal.h"
#include "tests/study/goal_choice.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::GoalChoice;

TEST_CASE("chaos that a run has shown is not measured again", "[study][goal]") {
  const sim::SystemSpec spec = make_lorenz();
  sim::Registry registry = make_registry();
  std::string last;
  int runs = 0, neighbours = 0;
  const GoalChoice choice =
      sim::study::choose_for_error({&spec, &registry}, {.budget = {1e-2, false}, .time = 60},
                                   [&](std::string_view what, double) {
                                     runs += what != last && what.ends_with(", the run");
                                     neighbours += what != last && what == "neighbour";
                                     last = what;
                                     return true;
                                   });
  CHECK(choice.chaotic);
  CHECK(runs == 2);
  CHECK(neighbours == 1);
}

TEST_CASE("the cost of a run is known before trials and after them", "[study][goal]") {
  const sim::SystemSpec spec = make_lorenz();
  sim::Registry registry = make_registry();
  const sim::study::Problem problem{&spec, &registry};
  const auto method = sim::study::fitting_methods(problem, {{"rk4"}}).front();
  sim::study::MethodTrials trials(problem, method, 1, 120, 0, false, false);
  CHECK(trials.cost_at(1200) == Approx(4 * 1200));
  for (int k = 0; k < 2; ++k) REQUIRE(trials.refine([](double) { return true; }));
  CHECK(trials.cost_at(60) == Approx(4 * 60));
  CHECK(trials.cost_at(1200) == Approx(4 * 1200));
}

// The run of 100 steps of rk4, and that of 200 which checks it; trials took both before.
TEST_CASE("checks of a run are told apart from trials", "[study][goal]") {
  const GoalChoice choice = choice_of(
      make_lorenz(), {.budget = {1e-2, false}, .time = 1, .integrators = {{"rk4"}}, .dt = 0.01});
  REQUIRE(choice.kept);
  REQUIRE(choice.cost > 0);
  CHECK(choice.check == 2 * choice.cost);
  CHECK(choice.trials == 3 * choice.cost);
}

TEST_CASE("candidates are told cheapest first, with the orders that they show", "[study][goal]") {
  const sim::SystemSpec spec = make_elastic_pendulum();
  const GoalChoice choice = choice_of(spec, {.budget = {1e-7, false}, .time = 2});
  REQUIRE(choice.candidates.size() > 4);
  sim::Registry registry = make_registry();
  double runs = 0;
  for (std::size_t k = 0; k < choice.candidates.size(); ++k) {
    const sim::study::GoalCandidate& each = choice.candidates[k];
    INFO(each.label << ", order " << each.order);
    if (k > 0) CHECK(choice.candidates[k - 1].cost <= each.cost);
    const sim::IntegratorInfo info = info_of(each.label, registry);
    if (!info.adaptive && each.runs > 1) {
      CHECK(each.order > 0.5 * info.order);
      CHECK(each.order <= info.order);
    }
    runs += each.runs;
  }
  CHECK(choice.candidates[0].label == choice.method->label);
  CHECK(choice.cost_of_ten < choice.candidates[0].cost);
  CHECK(choice.trials > runs);  // each has many evaluations
  CHECK(choice.cost < 3 * choice.candidates[0].cost);
}
