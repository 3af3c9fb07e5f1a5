// Rosenbrock stages on closed forms, and what they refuse.
#include "plugins/integrators/stiff/rosenbrock_stages.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/fields/field_system.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim_test;
using sim::test::load_text;

namespace {

// x' = -2 t x^2, y' = x y, z' = -500 (z - sin t) + cos t from (1, 1, 0):
// x = 1 / (1 + t^2), y = exp(atan t), z = sin t, the last after Prothero & Robinson (1974).
class Curved final : public Field {
 public:
  explicit Curved(bool knows) : knows_(knows) {}

  void eval(double t, std::span<const double> x, std::span<double> dxdt) const override {
    dxdt[0] = -2 * t * x[0] * x[0];
    dxdt[1] = x[0] * x[1];
    dxdt[2] = -kStiff * (x[2] - std::sin(t)) + std::cos(t);
  }
  const Sparsity* sparsity() const override { return knows_ ? &sparsity_ : nullptr; }
  void jacobian(double t, std::span<const double> x, std::span<double> values) const override {
    values[0] = -4 * t * x[0];
    values[1] = x[1];
    values[2] = x[0];
    values[3] = -kStiff;
  }
  static constexpr double kStiff = 500;

 private:
  bool knows_;
  Sparsity sparsity_{3, {{0, 0}, {0, 1}, {1, 1}, {2, 2}}};
};

FieldSystem system_of(bool knows) {
  const std::vector<double> start{1, 1, 0};
  return FieldSystem(start, 1, std::make_unique<Curved>(knows));
}

// The pair of the plugin, as its registration has it.
std::unique_ptr<Integrator> rodas(double tol) {
  static Registry registry = make_registry();
  return Method(registry, MethodChoice("rodas4", {{"tol", tol}})).make();
}

// The errors at t = 1 after so many equal steps: the larger one of x and y, and that of z.
std::pair<double, double> errors_at_one(int steps, bool knows) {
  static Registry registry = make_registry();
  FieldSystem system = system_of(knows);
  const auto method = Method(registry, MethodChoice("rodas4", {{"fixed_step", true}})).make();
  method->prepare(system);
  Array x(3), next(3);
  std::copy_n(system.start().data(), 3, x.data());
  for (int n = 0; n < steps; ++n) {
    const double h = 1.0 / steps;
    REQUIRE(method->step(system, n * h, h, x.data(), next.data()) == StepStatus::kDone);
    std::swap(x, next);
  }
  return {std::max(std::fabs(x[0] - 0.5), std::fabs(x[1] - std::exp(M_PI / 4))),
          std::fabs(x[2] - std::sin(1.0))};
}

}  // namespace

// Exact entries of the Jacobian or differences, also where f depends on t. The order falls where
// the rate is far above 1/h: to some 2.7 of z, whose error is small.
TEST_CASE("rodas4 is of order 4") {
  for (const bool knows : {true, false}) {
    const auto [coarse, coarse_stiff] = errors_at_one(20, knows);
    const auto [fine, fine_stiff] = errors_at_one(160, knows);
    INFO("errors " << coarse << ", " << fine << ", stiff " << coarse_stiff << ", " << fine_stiff);
    CHECK(std::log2(coarse / fine) / 3 > 3.8);
    CHECK(coarse < 1e-5);
    CHECK(coarse_stiff < 2e-6);
    CHECK(std::log2(coarse_stiff / fine_stiff) / 3 > 2.5);
  }
}

// R(z) = e^z + O(z^5), and no growth anywhere in the left half plane: 0 at infinity.
TEST_CASE("the stability function of rodas4 is L-stable and of order 4") {
  const auto method = rodas(1e-6);
  const auto radius_of = [&](double rate) {  // of x'' = -rate^2 x
    return method->amplification(rate, 0);
  };
  CHECK(radius_of(0.1) == Approx(1).margin(1e-6));
  CHECK(std::fabs(radius_of(0.2) - 1) < 70 * std::fabs(radius_of(0.1) - 1) + 1e-12);
  for (double rate = 1e-3; rate < 1e9; rate *= 1.7) {
    INFO(rate);
    CHECK(radius_of(rate) <= 1 + 1e-12);
    CHECK(method->amplification(rate, 2 * rate) <= 1 + 1e-12);  // critically damped
  }
  CHECK(radius_of(1e9) < 1e-6);
  // Overdamped: the slow eigenvalue is about -1e-3.
  CHECK(method->amplification(1, 1e3) == Approx(std::exp(-1e-3)).epsilon(1e-8));
}

TEST_CASE("rodas4 takes one factorisation a step and no iterations") {
  FieldSystem system = system_of(true);
  const auto method = rodas(1e-6);
  method->prepare(system);
  Array x(3), next(3);
  std::copy_n(system.start().data(), 3, x.data());
  method->restart(0, 1, x.data());
  REQUIRE(method->step(system, 0, 1, x.data(), next.data()) == StepStatus::kDone);
  const Effort effort = method->effort();
  CHECK(effort.newton == 0);
  // One more step, which ends at the state that was asked for: it needs no f there.
  CHECK(effort.factorisations == effort.steps + effort.rejected + 1);
  // 5 stages and f at the end; df/dt once a step; f at the start.
  CHECK(effort.evaluations == 1 + 7 * effort.steps + 5 * effort.rejected + 6);
}

// Dense output is of order 3, and z forgets what it was off before. The steps are the same,
// whatever states are asked for.
TEST_CASE("a state after many steps of rodas4 is as exact as their ends") {
  const auto error_at = [](double end, int states, std::int64_t& steps) {
    FieldSystem system = system_of(true);
    const auto method = rodas(1e-6);
    method->prepare(system);
    Array x(3), next(3);
    std::copy_n(system.start().data(), 3, x.data());
    const double h = end / states;
    method->restart(0, h, x.data());
    for (int n = 0; n < states; ++n) {
      REQUIRE(method->step(system, n * h, h, x.data(), next.data()) == StepStatus::kDone);
      std::swap(x, next);
    }
    steps = method->effort().steps;
    return std::fabs(x[2] - std::sin(end));
  };
  double once = 0, dense = 0;
  for (double end = 1; end < 3; end += 0.07) {
    std::int64_t steps = 0, same = 0;
    once += error_at(end, 1, steps);
    dense += error_at(end, 100, same);
    CHECK(steps >= 20);
    CHECK(steps == same);
  }
  INFO("errors " << once << ", " << dense);
  CHECK(once < 0.6 * dense);
}

// Van der Pol's oscillator on its slow branch: v = x / (mu (1 - x^2)) + O(mu^-3), with |v'| some
// 1e-12 and a rate of mu. Steps grow to 1e5 s, and the states asked for lie inside them.
TEST_CASE("rodas4 keeps stiff numbers inside its steps") {
  constexpr double kMu = 1e6;
  Registry registry = make_registry();
  const SystemSpec spec = load_text(R"(local mu = 1e6
      return sim.scene { state = {2, 0}, dt = 1e4, duration = 6e5, integrator = "rodas4",
      field = sim.field.formula { "v", "mu*(1 - x^2)*v - x", names = {"x", "v"}, mu = mu } })")
                              .systems[0];
  const RunOptions options{.integrator = {"rodas4", {{"rtol", 1e-4}, {"atol", 1e-10}}}, .dt = 1e4};
  Simulation simulation(spec, registry, options);
  for (int n = 1; n <= 60; ++n) {
    REQUIRE(simulation.step());
    const auto state = state_of(simulation);
    const double x = state[0], v = state[1];
    INFO("t = " << simulation.t() << ": x = " << x << ", v = " << v);
    CHECK(v == Approx(x / (kMu * (1 - x * x))).epsilon(1e-2));
    // log x - x^2/2 = t/mu + log 2 - 2 along the branch.
    CHECK(std::log(x) - x * x / 2 == Approx(simulation.t() / kMu + std::log(2.0) - 2).margin(1e-3));
  }
  CHECK(simulation.integrator().effort().steps < 60);
}

// The order is that of x and y; z follows with a lower one.
TEST_CASE("rodas4 is of order 3 inside its steps") {
  const auto error_of = [](double tol) {
    FieldSystem system = system_of(true);
    const auto method = rodas(tol);
    method->prepare(system);
    Array x(3), next(3);
    std::copy_n(system.start().data(), 3, x.data());
    method->restart(0, 0.01, x.data());
    double most = 0;
    for (int n = 0; n < 100; ++n) {
      REQUIRE(method->step(system, 0.01 * n, 0.01, x.data(), next.data()) == StepStatus::kDone);
      std::swap(x, next);
      const double t = 0.01 * (n + 1);
      most = std::max(
          {most, std::fabs(x[0] - 1 / (1 + t * t)), std::fabs(x[1] - std::exp(std::atan(t)))});
      CHECK(x[2] == Approx(std::sin(t)).margin(10 * tol));
    }
    return std::pair{most, static_cast<double>(method->effort().steps)};
  };
  const auto [coarse, few] = error_of(1e-4);
  const auto [fine, many] = error_of(1e-8);
  INFO("errors " << coarse << ", " << fine << " in " << few << ", " << many << " steps");
  CHECK(few < 50);
  CHECK(std::log(coarse / fine) / std::log(many / few) > 2.7);
  CHECK(coarse < 1e-3);
  CHECK(fine < 1e-7);
}

TEST_CASE("rodas4 refuses what has no entries of a Jacobian") {
  Registry registry = make_registry();
  const RunOptions options{.integrator = "rodas4", .dt = 0.01};
  CHECK_THROWS_WITH(
      Simulation(make_cloth(5), registry, options),
      Catch::Contains("integrator does not fit") && Catch::Contains("use esdirk43 or trbdf2"));
  const SystemSpec many = load_text(R"(local x = {}
    for i = 1, 101 do x[i] = i end
    return sim.scene { state = x, dt = 1, duration = 1, integrator = "rk4",
      field = sim.field.lua { function(t, y)
      local out = {} for i = 1, #y do out[i] = -y[i] end return out end } })")
                              .systems[0];
  CHECK_THROWS_WITH(Simulation(many, registry, options), Catch::Contains("sim.field.formula"));
}

// x' = x^2 from 1 blows up at t = 1.
TEST_CASE("rodas4 ends where the state does") {
  Registry registry = make_registry();
  const SystemSpec blow = load_text(R"(return sim.scene { state = {1}, dt = 0.5, duration = 2,
      field = sim.field.formula { "x*x", names = {"x"} }, integrator = "rodas4" })")
                              .systems[0];
  Simulation simulation(blow, registry, {.integrator = "rodas4", .dt = 0.5});
  REQUIRE(simulation.step());
  CHECK(state_of(simulation)[0] == Approx(2).epsilon(1e-4));
  int steps = 1;
  while (steps < 4 && simulation.step()) ++steps;
  CHECK(steps <= 2);
}
