// How long a study will take is estimated from runs that are short, whatever an evaluation costs.
#include "core/study/accuracy/cost_estimate.h"

#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "tests/support/scenes.h"

using namespace sim_test;

TEST_CASE("an estimate takes few evaluations where these take long") {
  constexpr double kMost = 5000;  // a pilot of cheap evaluations takes 200,000
  int evaluations = 0;
  sim::SystemSpec spec;
  spec.name = "slow";
  const sim::OdeFunction slow = [&](double, std::span<const double> x, std::span<double> dxdt) {
    ++evaluations;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    dxdt[0] = -x[0];
  };
  spec.first_order = sim::FirstOrderSpec{1, {1}, make_part("lua", {{"f", slow}})};
  spec.integrator = "rk4";
  spec.dt = 1e-5;
  sim::Registry registry = make_registry();
  const sim::study::Problem problem{&spec, &registry};
  const auto methods = sim::study::fitting_methods(problem, {{"rk4"}});
  const sim::study::CostEstimate pace = sim::study::cost_estimate(problem, methods, 10);
  CHECK(evaluations < kMost);
  CHECK(pace.seconds >= 1e-3);
}
