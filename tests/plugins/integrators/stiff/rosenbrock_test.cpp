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

// The largest error of x, y and z at t = 1 in steps whose tolerance is `tol`, and how many they
// are.
std::pair<double, double> error_at_one(double tol, bool knows) {
  FieldSystem system = system_of(knows);
  const auto method = rodas(tol);
  method->prepare(system);
  Array x(3), next(3);
  std::copy_n(system.start().data(), 3, x.data());
  method->restart(0, 1, x.data());
  REQUIRE(method->step(system, 0, 1, x.data(), next.data()) == StepStatus::kDone);
  const double error = std::max({std::fabs(next[0] - 0.5), std::fabs(next[1] - std::exp(M_PI / 4)),
                                 std::fabs(next[2] - std::sin(1.0))});
  return {error, static_cast<double>(method->effort().steps)};
}

}  // namespace

// Errors fall as the fourth power of the steps, or faster: exact entries of the Jacobian or
// differences, also where f depends on t.
TEST_CASE("rodas4 is of order 4") {
  for (const bool knows : {true, false}) {
    const auto [coarse, few] = error_at_one(1e-5, knows);
    const auto [fine, many] = error_at_one(1e-9, knows);
    INFO("errors " << coarse << ", " << fine << " in " << few << ", " << many << " steps");
    CHECK(many > 4 * few);
    CHECK(std::log(coarse / fine) / std::log(many / few) > 3.5);
    CHECK(coarse < 1e-4);
    CHECK(fine < 1e-8);
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
  CHECK(effort.factorisations == effort.steps + effort.rejected);
  // 5 stages and f at the end; df/dt once a step; f at the start.
  CHECK(effort.evaluations == 1 + 7 * effort.steps + 5 * effort.rejected);
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
