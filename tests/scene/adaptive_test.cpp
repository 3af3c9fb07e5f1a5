// Adaptive methods keep their tolerance: neither far worse nor far better.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>

#include "core/scene/simulation.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// The error of x' = i x after one turn, by the exact solution.
double error_after_a_turn(const std::string& method, double tolerance) {
  sim::Registry registry = make_registry();
  const double dt = 2 * M_PI / 64;
  sim::Simulation circle(make_circle(), registry,
                         {.integrator = {method, {{"tol", tolerance}}}, .dt = dt});
  REQUIRE(run(circle, 64));
  const sim::Vec3 off =
      circle.position(0) - sim::Vec3(std::cos(circle.t()), std::sin(circle.t()), 0);
  return off.norm();
}

}  // namespace

// Every step keeps its estimated error below the tolerance, and a turn is a few to a hundred steps,
// whose errors add up.
TEST_CASE("the error of an adaptive method follows its tolerance") {
  for (const std::string method : {"bs23", "rkf45", "dopri5", "tsit5", "dop853"})
    for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
      const double error = error_after_a_turn(method, tolerance);
      INFO(method << ", tolerance " << tolerance << ": " << error);
      CHECK(error < 50 * tolerance);
      CHECK(error > 0.02 * tolerance);
    }
}
