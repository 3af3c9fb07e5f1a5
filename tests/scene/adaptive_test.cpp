// Adaptive integrators: what a tolerance promises, and that the states asked for change no step.
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "core/base/array.h"
#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

using Given = std::map<std::string, sim::Value>;

std::unique_ptr<sim::Integrator> make_method(const std::string& name, const Given& given,
                                             sim::Registry& registry) {
  const sim::IntegratorPlugin& plugin = registry.integrator(name);
  return plugin.make(sim::Params(name, plugin.params, given, {}));
}

std::vector<std::string> adaptive_methods(sim::Registry& registry) {
  std::vector<std::string> names;
  for (const std::string& name : registry.names(sim::PluginKind::kIntegrator))
    if (make_method(name, {}, registry)->info().adaptive) names.push_back(name);
  REQUIRE(names.size() >= 5);
  return names;
}

sim::RunOptions with_tol(const std::string& method, double tol, double dt) {
  return {.integrator = method, .integrator_given = {{"tol", tol}}, .dt = dt};
}

// A flat ODE whose right-hand side is written here.
sim::SystemSpec make_ode(std::vector<double> state, sim::OdeFunction f) {
  sim::SystemSpec spec;
  spec.name = "ode";
  spec.integrator = "rk4";
  spec.dt = 0.1;
  spec.first_order = sim::FirstOrderSpec{
      .dimension = 1, .state = std::move(state), .field = make_part("lua", {{"f", std::move(f)}})};
  return spec;
}

// The largest error of the elastic pendulum's position (m) and velocity (m/s) at t = 10 s.
double pendulum_error(const sim::Simulation& simulation) {
  const Table table("elastic_pendulum.csv");
  const Row exact = table.rows_where("t", 10).at(0);
  const sim::Vec3 x = simulation.position(1), v = simulation.velocity(1);
  double error = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, static_cast<char>('x' + axis));
    error = std::max({error, std::fabs(x[axis] - exact.number(name)),
                      std::fabs(v[axis] - exact.number("v" + name))});
  }
  return error;
}

// Integrator and system apart from a run: steps of h from the system's first state.
struct Bench {
  Bench(const sim::SystemSpec& spec, const std::string& method, const Given& given,
        sim::Registry& registry)
      : simulation(spec, registry),
        integrator(make_method(method, given, registry)),
        x(simulation.ode().size()),
        next(x.size()) {
    std::ranges::copy(simulation.state(), x.data());
    integrator->prepare(simulation.ode());
    integrator->restart(0, 0, x.data());
  }

  bool step(int n, double h) {
    const auto status = integrator->step(simulation.ode(), n * h, h, x.data(), next.data());
    std::swap(x, next);
    return status == sim::StepStatus::kDone;
  }

  std::vector<double> state() const { return {x.data(), x.data() + x.size()}; }

  sim::Simulation simulation;
  std::unique_ptr<sim::Integrator> integrator;
  sim::Array x, next;
};

}  // namespace

TEST_CASE("the error follows the tolerance over seven decades") {
  sim::Registry registry = make_registry();
  for (const std::string& method : adaptive_methods(registry)) {
    double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
    std::vector<std::pair<double, double>> points;
    for (int decade = 3; decade <= 10; ++decade) {
      const double tol = std::pow(10, -decade);
      sim::Simulation simulation(make_elastic_pendulum(), registry, with_tol(method, tol, 0.4));
      REQUIRE(run(simulation, 25));
      const double error = pendulum_error(simulation);
      INFO(method << ", tol " << tol << ": error " << error);
      CHECK(error < 200 * tol);  // about 10 of these are the pendulum's own growth of errors
      points.emplace_back(std::log10(tol), std::log10(error));
      mean_x += points.back().first / 8;
      mean_y += points.back().second / 8;
    }
    for (const auto& [x, y] : points) {
      xx += (x - mean_x) * (x - mean_x);
      xy += (x - mean_x) * (y - mean_y);
    }
    INFO(method);
    CHECK(xy / xx == Approx(1).margin(0.25));
  }
}

TEST_CASE("the interval of the states changes no step and no bit") {
  sim::Registry registry = make_registry();
  for (const std::string& method : adaptive_methods(registry)) {
    INFO(method);
    // Powers of 2, so that all end at the same double.
    sim::Simulation coarse(make_elastic_pendulum(), registry, with_tol(method, 1e-6, 2)),
        medium(make_elastic_pendulum(), registry, with_tol(method, 1e-6, 0.125)),
        fine(make_elastic_pendulum(), registry, with_tol(method, 1e-6, 1.0 / 1024));
    REQUIRE(run(coarse, 5));
    REQUIRE(run(medium, 80));
    REQUIRE(run(fine, 10240));
    CHECK(fine.t() == 10);
    CHECK(same_bits(state_of(coarse), state_of(fine)));
    CHECK(same_bits(state_of(coarse), state_of(medium)));
    const sim::Effort few = coarse.integrator().effort(), many = fine.integrator().effort();
    CHECK(few.steps > 50);
    CHECK(few.steps == many.steps);
    CHECK(few.rejected == many.rejected);
    // States inside a step may cost its further stages, once.
    CHECK(many.evaluations <= few.evaluations + 3 * few.steps);
  }
}

TEST_CASE("states between the steps have the order of the dense output") {
  sim::Registry registry = make_registry();
  const std::map<std::string, int> stated = {
      {"bs23", 3}, {"rkf45", 4}, {"dopri5", 4}, {"tsit5", 4}, {"dop853", 7}};
  // A rotation and a decay: z' = lambda z in the complex plane.
  const std::complex<double> lambda(-0.3, 0.8);
  const sim::SystemSpec spec =
      make_ode({1, 0}, [=](double, std::span<const double> x, std::span<double> dxdt) {
        const std::complex<double> d = lambda * std::complex<double>(x[0], x[1]);
        dxdt[0] = d.real();
        dxdt[1] = d.imag();
      });
  for (const std::string& method : adaptive_methods(registry)) {
    INFO(method);
    REQUIRE(stated.count(method));
    // One step of size h, put there as if it had been taken; the largest error at some thetas.
    const auto error_of = [&](double h, const std::vector<double>& thetas) {
      double worst = 0;
      for (const double theta : thetas) {
        Bench bench(spec, method, {}, registry);
        bench.integrator->recall(std::vector<double>{0, h, h, 1, 0, 1, 0});
        REQUIRE(bench.step(0, theta * h));
        CHECK(bench.integrator->effort().steps == 0);
        worst = std::max(worst, std::abs(std::complex<double>(bench.x[0], bench.x[1]) -
                                         std::exp(lambda * theta * h)));
      }
      return worst;
    };
    const double h = method == "dop853" ? 1 : 0.1;
    const auto observed = [&](const std::vector<double>& thetas) {
      return std::log2(error_of(h, thetas) / error_of(h / 2, thetas));
    };
    CHECK(observed({0.15, 0.3, 0.45, 0.6, 0.75, 0.9}) ==
          Approx(stated.at(method) + 1).margin(0.25));
    const int order = make_method(method, {}, registry)->info().order;
    CHECK(observed({1}) == Approx(order + 1).margin(0.25));
  }
}

TEST_CASE("memory is all that the next step depends on") {
  sim::Registry registry = make_registry();
  for (const std::string& method : adaptive_methods(registry)) {
    INFO(method);
    const double h = 0.03;
    Bench whole(make_cloth(5), method, {}, registry), again(make_cloth(5), method, {}, registry);
    CHECK(whole.integrator->memory().empty());
    for (int n = 0; n < 10; ++n) REQUIRE(whole.step(n, h));
    const std::vector<double> memory = whole.integrator->memory();
    std::ranges::copy(whole.x.span(), again.x.data());
    again.integrator->recall(memory);
    CHECK(same_bits(again.integrator->memory(), memory));
    for (int n = 10; n < 30; ++n) {
      REQUIRE(whole.step(n, h));
      REQUIRE(again.step(n, h));
      REQUIRE(same_bits(whole.state(), again.state()));
    }
    // Without it the steps are others.
    Bench without(make_cloth(5), method, {}, registry);
    for (int n = 0; n < 10; ++n) REQUIRE(without.step(n, h));
    without.integrator->restart(10 * h, h, without.x.data());
    for (int n = 10; n < 30; ++n) REQUIRE(without.step(n, h));
    CHECK_FALSE(same_bits(whole.state(), without.state()));
    // A memory that does not fit is as good as none.
    again.integrator->recall(std::vector<double>(3));
    CHECK(again.integrator->memory().empty());
  }
}

// x' = -x, from t = 1 on 3000 times as fast towards 2: the step that looked right is not.
TEST_CASE("a step that was too long is repeated") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec =
      make_ode({1}, [](double t, std::span<const double> x, std::span<double> dxdt) {
        dxdt[0] = t < 1 ? -x[0] : 3000 * (2 - x[0]);
      });
  for (const std::string& method : adaptive_methods(registry)) {
    INFO(method);
    sim::Simulation simulation(spec, registry, with_tol(method, 1e-6, 0.125));
    REQUIRE(run(simulation, 7));
    CHECK(simulation.component(0) == Approx(std::exp(-0.875)).margin(2e-6));
    REQUIRE(run(simulation, 2));
    CHECK(simulation.integrator().effort().rejected > 0);
    CHECK(simulation.component(0) == Approx(2).margin(2e-5));
  }
}

TEST_CASE("a solution that ends before the run does is told, not waited for") {
  sim::Registry registry = make_registry();
  // x' = x^2: x = 1 / (1 - t)
  const sim::SystemSpec spec = make_ode({1}, [](double, std::span<const double> x,
                                                std::span<double> dxdt) { dxdt[0] = x[0] * x[0]; });
  for (const std::string& method : adaptive_methods(registry)) {
    INFO(method);
    sim::Simulation simulation(spec, registry, with_tol(method, 1e-6, 0.1));
    REQUIRE(run(simulation, 9));
    CHECK(simulation.component(0) == Approx(10).epsilon(1e-3));
    CHECK_FALSE(run(simulation, 2));
    CHECK(simulation.divergence().status != sim::StepStatus::kDone);
    CHECK(simulation.t() < 1.05);
    CHECK(std::isfinite(simulation.component(0)));
    CHECK(simulation.integrator().effort().steps < 100000);
    simulation.reset();
    CHECK(run(simulation, 9));
  }
}

TEST_CASE("no step is longer than max_step, and both tolerances count") {
  sim::Registry registry = make_registry();
  for (const std::string& method : adaptive_methods(registry)) {
    INFO(method);
    const auto steps = [&](const Given& given) {
      sim::Simulation simulation(make_elastic_pendulum(), registry,
                                 {.integrator = method, .integrator_given = given, .dt = 1});
      REQUIRE(run(simulation, 4));
      return simulation.integrator().effort().steps;
    };
    CHECK(steps({{"tol", 1e-3}, {"max_step", 1e-3}}) >= 4000);
    const auto plain = steps({{"tol", 1e-6}});
    CHECK(steps({{"atol", 1e-6}, {"rtol", 1e-6}}) == plain);
    CHECK(steps({{"rtol", 1e-9}}) > plain);
    CHECK(steps({{"atol", 1e-9}}) > plain);
    CHECK(steps({{"atol", 1e-9}, {"rtol", 1e-9}}) > 1.3 * plain);
  }
}

TEST_CASE("fixed_step takes the method alone, step by step") {
  sim::Registry registry = make_registry();
  for (const std::string& method : adaptive_methods(registry)) {
    INFO(method);
    sim::Simulation simulation(make_elastic_pendulum(), registry,
                               fixed_steps(method, 0.01, registry));
    REQUIRE(run(simulation, 50));
    CHECK_FALSE(simulation.integrator_info().adaptive);
    const sim::Effort effort = simulation.integrator().effort();
    CHECK(effort.steps == 50);
    CHECK(effort.rejected == 0);
    CHECK(effort.evaluations == 50 * simulation.integrator_info().evaluations);
  }
}
