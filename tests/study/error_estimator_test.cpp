// Errors that are told while a run goes on, against closed forms.
#include "core/study/accuracy/error_estimator.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// x_i' = -i x_i from 1: of the first number no method has an error.
sim::SystemSpec make_decays(std::size_t count) {
  sim::SystemSpec spec;
  const sim::OdeFunction f = [](double, std::span<const double> x, std::span<double> dxdt) {
    for (std::size_t i = 0; i < x.size(); ++i) dxdt[i] = -static_cast<double>(i) * x[i];
  };
  spec.first_order =
      sim::FirstOrderSpec{1, std::vector<double>(count, 1), make_part("lua", {{"f", f}})};
  return spec;
}

}  // namespace

// x_i = R^n with R = sum of (-i h)^k / k! up to the order p; the error is 1 / (1 - 2^-p) times the
// distance from as many times two steps of h / 2, over all numbers.
TEST_CASE("the error of a list of numbers is the length of the errors of all") {
  sim::Registry registry = make_registry();
  constexpr double kStep = 0.02;
  for (const auto& [method, order] : {std::pair{"euler", 1}, {"midpoint", 2}, {"rk4", 4}})
    for (const std::size_t count : {1u, 2u, 3u, 5u}) {
      const auto factor = [&](double z) {
        double sum = 1, term = 1;
        for (int k = 1; k <= order; ++k) sum += term *= z / k;
        return sum;
      };
      sim::SystemSpec spec = make_decays(count);
      sim::Simulation run(spec, registry, {.integrator = method, .dt = kStep});
      sim::study::ErrorEstimator told(spec, run, registry);
      for (int n = 1; n <= 20; ++n) {
        REQUIRE(run.step());
        double square = 0;
        for (std::size_t i = 0; i < count; ++i) {
          const double z = -kStep * static_cast<double>(i);
          square += std::pow(std::pow(factor(z), n) - std::pow(factor(z / 2), 2 * n), 2);
        }
        const std::vector<double> errors = told.errors(run);
        REQUIRE(errors.size() == 1);
        INFO(method << ", " << count << " numbers, step " << n);
        CHECK(errors[0] ==
              Approx(std::sqrt(square) / (1 - std::pow(2, -order))).epsilon(1e-6).margin(1e-15));
      }
    }
}

// A fall from rest by Euler's method is short by g h t / 2, whatever the particle; half the step
// by half of that, and the estimate is exact.
TEST_CASE("the error of each particle is its own") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list.clear();
  for (const double x : {0.0, 1.0, 2.0}) spec.particles->list.push_back({.position = {x, x, 0}});
  spec.particles->pinned = {1};
  constexpr double kStep = 0.01;
  sim::Simulation run(spec, registry, {.integrator = "euler", .dt = kStep});
  sim::study::ErrorEstimator told(spec, run, registry);
  for (int n = 1; n <= 50; ++n) {
    REQUIRE(run.step());
    const std::vector<double> errors = told.errors(run);
    REQUIRE(errors.size() == 3);
    const double right = 0.5 * kGravity * kStep * run.t();
    CHECK(errors[0] == Approx(right));
    CHECK(errors[1] == 0);
    CHECK(errors[2] == Approx(right));
  }
}
