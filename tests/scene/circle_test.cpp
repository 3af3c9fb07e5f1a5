// The circle x' = (-y, x, 0): every method multiplies x + iy by R(ih) each step, exactly.
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

TEST_CASE("the circle follows the table of exact amplification") {
  const Table table("circle.csv");
  sim::Registry registry = make_registry();
  std::string method;
  double h = 0;
  std::optional<sim::Simulation> simulation;
  for (const Row& row : table.rows()) {
    // Rows of one method and step size follow one another by the number of steps.
    if (row.text("method") != method || row.number("h") != h) {
      method = row.text("method");
      h = row.number("h");
      simulation.emplace(make_circle(), registry, sim::RunOptions{.integrator = method, .dt = h});
    }
    const auto n = static_cast<std::int64_t>(row.number("n"));
    REQUIRE(run(*simulation, n - simulation->step_count()));
    INFO(method << " h " << h << " n " << n);
    const double x = simulation->component(0), y = simulation->component(1);
    const double radius = row.number("radius");
    CHECK(std::hypot(x - row.number("x"), y - row.number("y")) <= 1e-12 * radius);
    CHECK(std::abs(std::hypot(x, y) - radius) <= 1e-12 * radius);
    CHECK(simulation->component(2) == 0);
  }
}

TEST_CASE("the radius of the circle grows by the modulus of R(ih)") {
  sim::Registry registry = make_registry();
  const double h = 0.07;
  const int n = 1000;
  const double h2 = h * h;
  const std::pair<const char*, double> squared[] = {
      {"euler", 1 + h2},
      {"trapezoid", 1 + h2 * h2 / 4},
      {"rk4", 1 - h2 * h2 * h2 / 72 + h2 * h2 * h2 * h2 / 576}};
  for (const auto& [method, per_step] : squared) {
    sim::Simulation simulation(make_circle(), registry, {.integrator = method, .dt = h});
    REQUIRE(run(simulation, n));
    const double radius = std::hypot(simulation.component(0), simulation.component(1));
    CHECK(radius == Approx(std::pow(per_step, n / 2.0)).epsilon(1e-12));
  }
}

TEST_CASE("rotations of many points do not mix") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_circle();
  const std::vector<double> state = {1, 0, 0, 0, 2, 0.5, -3, 0, -7};
  spec.first_order->state = state;
  spec.first_order->field.given["omega"] = -2.0;
  sim::Simulation many(spec, registry, {.dt = 0.01});
  REQUIRE(run(many, 100));
  CHECK(many.particles() == 3);
  for (int i = 0; i < 3; ++i) {
    spec.first_order->state.assign(state.begin() + 3 * i, state.begin() + 3 * i + 3);
    sim::Simulation one(spec, registry, {.dt = 0.01});
    REQUIRE(run(one, 100));
    CHECK(many.position(i) == one.position(0));
  }
  CHECK(many.position(2).z() == -7);
  CHECK(many.position(0).x() == Approx(std::cos(2.0)).epsilon(1e-8));
  CHECK(many.position(0).y() == Approx(-std::sin(2.0)).epsilon(1e-8));
}
