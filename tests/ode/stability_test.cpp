// Limits of stability, computed from the coefficients of every method.
#include "core/ode/stability.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "core/ode/explicit/composition.h"
#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

sim::Amplification radius_of(const std::string& name, sim::Registry& registry) {
  const std::shared_ptr<sim::Integrator> method = sim::Method(registry, name).make();
  return
      [method](double h_omega, double h_gamma) { return method->amplification(h_omega, h_gamma); };
}

}  // namespace

TEST_CASE("the limits of every explicit method are the published ones") {
  sim::Registry registry = make_registry();
  const Table table("stability_limits.csv");
  for (const Row& row : table.rows()) {
    INFO(row.text("method"));
    const sim::Amplification radius = radius_of(row.text("method"), registry);
    CHECK(sim::stable_step(radius, 1, 0) ==
          Approx(row.number("oscillation")).epsilon(1e-9).margin(0));
    if (std::isinf(row.number("decay")))
      CHECK(sim::stable_step(radius, 0, 1) > 400);
    else
      CHECK(sim::stable_step(radius, 0, 1) == Approx(row.number("decay")).epsilon(1e-9));
  }
}

// The stiffest mode of the 8 x 8 cloth and its drag.
TEST_CASE("drag gives methods a limit that have none without") {
  sim::Registry registry = make_registry();
  const double omega = 192.678, gamma = 2;
  const auto limit = [&](const std::string& name) {
    return sim::stable_step(radius_of(name, registry), omega, gamma);
  };
  CHECK(limit("euler") == Approx(gamma / (omega * omega)).epsilon(1e-6));
  CHECK(limit("trapezoid") == Approx(1.8327e-3).epsilon(1e-4));
  CHECK(limit("rk4") == Approx(1.474e-2).epsilon(1e-3));
  CHECK(limit("verlet") == Approx(1.038e-2).epsilon(1e-3));
}

// A step with the determinant 1 and the trace T = 2 - z^2 grows by nothing within the limit, and
// beyond it by the larger root of r^2 - |T| r + 1 = 0.
TEST_CASE("how fast a step grows beyond its limit is the root of its polynomial") {
  sim::Registry registry = make_registry();
  for (const char* name : {"verlet", "symplectic_euler"})
    for (const double z : {0.3, 1.0, 1.999, 2.001, 2.1, 3.0, 10.0}) {
      CAPTURE(name, z);
      const double trace = std::abs(2 - z * z);
      const double root = trace > 2 ? trace / 2 + std::sqrt(trace * trace / 4 - 1) : 1;
      CHECK(radius_of(name, registry)(z, 0) == Approx(root).epsilon(1e-12));
    }
  // With the exact damping of both kicks of half a step, e = e^(-g/2): the determinant is e^2, and
  // the trace 1 + e^2 - (1 + e) z^2 s with s = (1 - e) / g.
  for (const double g : {0.2, 1.5})
    for (const double z : {0.5, 2.5, 4.0}) {
      CAPTURE(g, z);
      const double e = std::exp(-g / 2), gain = (1 - e) / g;
      const double trace = 1 + e * e - (1 + e) * z * z * gain, square = trace * trace / 4 - e * e;
      const double root = square > 0 ? std::abs(trace) / 2 + std::sqrt(square) : e;
      CHECK(radius_of("verlet", registry)(z, g) == Approx(root).epsilon(1e-12));
    }
}

TEST_CASE("a radius that is not known gives no limit") {
  CHECK(std::isnan(sim::stable_step([](double, double) { return std::nan(""); }, 1, 0)));
  CHECK(std::isinf(sim::stable_step([](double, double) { return 1.0; }, 1, 0)));
  CHECK(std::isinf(sim::stable_step([](double, double) { return 2.0; }, 0, 0)));
}

TEST_CASE("eigenvalues of an oscillator keep their digits when one is small") {
  const auto [fast, slow] = sim::oscillator_eigenvalues(1e-6, 3);
  CHECK(fast.real() == Approx(-3).epsilon(1e-12));
  CHECK(slow.real() == Approx(-1e-12 / 3).epsilon(1e-11));
  const auto [up, down] = sim::oscillator_eigenvalues(2, 1);
  CHECK(up == std::conj(down));
  CHECK(std::norm(up) == Approx(4).epsilon(1e-14));
}

TEST_CASE("the order of a composition depends on every coefficient") {
  sim::Composition<2> leapfrog{.drift = {0.5, 0.5, 0}, .kick = {1, 0}};
  CHECK(sim::order_conditions(leapfrog) == 2);
  leapfrog.drift[0] += 1e-6;
  CHECK(sim::order_conditions(leapfrog) == 0);
  leapfrog.drift[1] -= 1e-6;
  CHECK(sim::order_conditions(leapfrog) == 1);

  // Three, and three times three, leapfrog steps: orders 4 and 6. Yoshida (1990), eq. (3.1).
  const auto triple = [](const auto& inner, double power) {
    constexpr int m = static_cast<int>(std::tuple_size_v<decltype(inner.kick)>);
    sim::Composition<3 * m> result;
    const double outer = 1 / (2 - std::pow(2, 1 / power));
    for (int part = 0; part < 3; ++part) {
      const double w = part == 1 ? 1 - 2 * outer : outer;
      for (int i = 0; i <= m; ++i)
        result.drift[static_cast<std::size_t>(part * m + i)] +=
            w * inner.drift[static_cast<std::size_t>(i)];
      for (int i = 0; i < m; ++i)
        result.kick[static_cast<std::size_t>(part * m + i)] =
            w * inner.kick[static_cast<std::size_t>(i)];
    }
    return result;
  };
  const sim::Composition<1> step{.drift = {0.5, 0.5}, .kick = {1}};
  CHECK(sim::order_conditions(triple(step, 3)) == 4);
  CHECK(sim::order_conditions(triple(triple(step, 3), 5)) == 6);
  CHECK(sim::order_conditions(triple(step, 3.001)) == 2);
}
