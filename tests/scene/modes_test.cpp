// A row of springs at rest length vibrates in exact modes: n steps multiply one by R(i h omega)^n.
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <numbers>

#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

using Complex = std::complex<double>;

constexpr int kFree = 10;
constexpr double kAmplitude = 1e-3;  // m; small against the spacing, so that none overtakes

double shape(int mode, int j) { return std::sin(mode * j * std::numbers::pi / (kFree + 1)); }

// Pinned ends at x = 0 and 11, particles of 0.1 kg between, springs of 100 N/m, all in one mode.
sim::SystemSpec make_row(int mode) {
  sim::SystemSpec spec;
  spec.name = "row";
  spec.integrator = "rk4";
  spec.dt = 0.002;
  spec.particles.emplace();
  spec.particles->pinned = {0, kFree + 1};
  sim::PartSpec springs = make_springs("link", 100);
  for (int j = 0; j <= kFree + 1; ++j) {
    const bool end = j == 0 || j == kFree + 1;
    spec.particles->list.push_back(
        {.position = {j + (end ? 0 : kAmplitude * shape(mode, j)), 0, 0}, .mass = 0.1});
    if (j > 0) springs.links.ties.push_back({.a = j - 1, .b = j, .rest = 1});
  }
  spec.forces = {springs};
  return spec;
}

// omega q - i v of the mode, q and v its amplitude and speed: turns as exp(i omega t).
Complex amplitude(const sim::Simulation& simulation, int mode, double omega) {
  double q = 0, v = 0;
  for (int j = 1; j <= kFree; ++j) {
    q += 2.0 / (kFree + 1) * shape(mode, j) * (simulation.position(j).x() - j);
    v += 2.0 / (kFree + 1) * shape(mode, j) * simulation.velocity(j).x();
  }
  return {omega * q, -v};
}

Complex stability_function(const std::string& method, Complex z) {
  Complex term = 1, sum = 1;
  const int order = method == "euler" ? 1 : method == "trapezoid" ? 2 : 4;
  for (int i = 1; i <= order; ++i) sum += term *= z / static_cast<double>(i);
  return sum;
}

}  // namespace

TEST_CASE("modes of a chain turn and grow as R(i h omega) says") {
  sim::Registry registry = make_registry();
  const int n = 100;
  const double h = 0.002;
  const Table table("linear_chain.csv");
  for (const Row& row : table.rows()) {
    const int mode = static_cast<int>(row.number("mode"));
    const double omega = row.number("omega");
    for (const std::string method : {"euler", "trapezoid", "rk4"}) {
      sim::Simulation simulation(make_row(mode), registry, {.integrator = method, .dt = h});
      const Complex start = amplitude(simulation, mode, omega);
      CHECK(std::abs(start - omega * kAmplitude) <= 1e-12 * omega);
      REQUIRE(run(simulation, n));
      const Complex factor = std::pow(stability_function(method, {0, h * omega}), n);
      INFO(method << " mode " << mode);
      CHECK(std::abs(amplitude(simulation, mode, omega) - factor * start) <=
            1e-9 * std::abs(factor * start));
      CHECK(simulation.position(1).y() == 0);
    }
  }
}

TEST_CASE("rk4 is stable just below h omega = 2.83 and unstable just above") {
  sim::Registry registry = make_registry();
  const double omega = 62.60180466431455;  // the highest mode
  for (const double factor : {0.99, 1.01}) {
    const double h = factor * 2.8284271247461901 / omega;
    sim::Simulation simulation(make_row(kFree), registry, {.dt = h});
    const double start = std::abs(amplitude(simulation, kFree, omega));
    REQUIRE(run(simulation, 60));
    CHECK((std::abs(amplitude(simulation, kFree, omega)) < start) == (factor < 1));
  }
}
