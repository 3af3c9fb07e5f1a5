// A row of springs at rest length vibrates in exact modes: n steps multiply one by R(i h omega)^n.
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/ode/stability.h"
#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

using Complex = std::complex<double>;

constexpr int kFree = 10;
constexpr double kAmplitude = 1e-3;  // m; small against the spacing, so that none overtakes

double shape(int mode, int j) { return std::sin(mode * j * std::numbers::pi / (kFree + 1)); }

// omega q - i v of the mode, q and v its amplitude and speed: turns as exp(i omega t).
Complex amplitude(const sim::Simulation& simulation, int mode, double omega) {
  double q = 0, v = 0;
  for (int j = 1; j <= kFree; ++j) {
    q += 2.0 / (kFree + 1) * shape(mode, j) * (simulation.position(j).x() - j);
    v += 2.0 / (kFree + 1) * shape(mode, j) * simulation.velocity(j).x();
  }
  return {omega * q, -v};
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
      const int order = method == "euler" ? 1 : method == "trapezoid" ? 2 : 4;
      Complex term = 1, taylor = 1;
      for (int i = 1; i <= order; ++i) taylor += term *= Complex(0, h * omega) / double(i);

      sim::Simulation simulation(make_row(mode, kAmplitude), registry,
                                 {.integrator = method, .dt = h});
      const Complex start = amplitude(simulation, mode, omega);
      CHECK(std::abs(start - omega * kAmplitude) <= 1e-12 * omega);
      REQUIRE(run(simulation, n));
      const Complex factor = std::pow(taylor, n);
      INFO(method << " mode " << mode);
      CHECK(std::abs(amplitude(simulation, mode, omega) - factor * start) <=
            1e-9 * std::abs(factor * start));
      CHECK(simulation.position(1).y() == 0);
    }
  }
}

// Runs on the highest mode of the chain, against the spectral radius that each method computes from
// its coefficients: so do the limits it claims hold where springs are.
TEST_CASE("every integrator grows or decays as its amplification says") {
  sim::Registry registry = make_registry();
  const double omega = 62.60180466431455;
  const sim::SystemSpec row = make_row(kFree, kAmplitude);
  for (const std::string& method : methods_with_order(row, registry)) {
    sim::Simulation probe(row, registry, fixed_steps(method, 0.01, registry));
    const double limit = sim::stable_step(probe.integrator(), 1, 0);
    REQUIRE_FALSE(std::isnan(limit));
    const bool bounded = limit > 0 && std::isfinite(limit);

    for (const double h_omega : {0.1, 0.5, 0.99 * limit, 1.01 * limit}) {
      if (!bounded && h_omega != 0.1 && h_omega != 0.5) continue;
      sim::Simulation run_of(row, registry, fixed_steps(method, h_omega / omega, registry));
      const sim::IntegratorInfo info = probe.integrator_info();
      const bool splits = info.symplectic || method == "imex";
      const bool exact_rate = !splits || (info.implicit && !info.needs_second_order);
      const double expected = probe.integrator().amplification(h_omega, 0);
      // Neighbours stay apart, also in stages far beyond the step.
      const int n = exact_rate && expected > 1.1 ? 4 : 20;
      REQUIRE(run(run_of, n));
      const double early = std::abs(amplitude(run_of, kFree, omega));
      REQUIRE(run(run_of, n));
      const double late = std::abs(amplitude(run_of, kFree, omega));
      const double rate = std::pow(late / early, 1.0 / n);
      INFO(method << ", h omega = " << h_omega << ": " << rate << " a step, expected " << expected);
      // A method that takes what is too fast implicitly has no growth.
      if (run_of.integrator().limiting_part()) {
        CHECK(rate == Approx(1).epsilon(1e-6));
        continue;
      }
      // The amplitude of a splitting swings about its mean; it must grow beyond the limit only.
      if (exact_rate)
        CHECK(rate == Approx(expected).epsilon(1e-6));
      else
        CHECK((late > 20 * kAmplitude * omega) == (h_omega > limit));
    }
  }
}
