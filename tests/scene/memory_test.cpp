// Forces with a memory of their own in X: every method steps it, snapshots and checkpoints keep it.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/hash.h"
#include "core/session/checkpoint.h"
#include "core/session/difference.h"
#include "core/session/timeline.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// A cloth in a gusty wind along z.
sim::SystemSpec make_flag(int n, double breeze = 1.5) {
  sim::SystemSpec spec = make_cloth(n, {.drag = 0});
  spec.forces.push_back(make_part("gust", {{"velocity", sim::Vec3(0, 0, 2)},
                                           {"breeze", breeze},
                                           {"tau", 0.2},
                                           {"c", 0.5 / (n * n)},
                                           {"seed", std::int64_t{7}}}));
  return spec;
}

// One particle of 1 kg that only the air moves.
sim::SystemSpec make_dust(double breeze) {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list[0] = {.mass = 1};
  spec.forces = {make_part(
      "gust", {{"velocity", sim::Vec3(3, 0, -1)}, {"breeze", breeze}, {"tau", 0.4}, {"c", 2.0}})};
  return spec;
}

const sim::StatePart& air(const sim::Simulation& simulation) {
  const sim::StatePart* part = simulation.shape().find("memory of 'gust'");
  REQUIRE(part);
  return *part;
}

std::vector<double> end_of(const sim::SystemSpec& spec, sim::Registry& registry,
                           sim::RunOptions options, double time) {
  sim::Simulation simulation(spec, registry, options);
  REQUIRE(run(simulation, simulation.steps_for(time)));
  std::vector<double> numbers;
  for (const auto& [begin, end] : simulation.shape().ranges())
    numbers.insert(numbers.end(), simulation.state().begin() + static_cast<std::ptrdiff_t>(begin),
                   simulation.state().begin() + static_cast<std::ptrdiff_t>(end));
  return numbers;
}

double worst(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

}  // namespace

TEST_CASE("air without gusts keeps its velocity and takes dust along as the closed form says") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_dust(0);
  for (const char* method : {"rk4", "dopri5", "implicit_midpoint", "verlet", "pefrl"}) {
    INFO(method);
    sim::Simulation simulation(spec, registry, {.integrator = {method}, .dt = 1e-3});
    CHECK(air(simulation).count == 3);
    REQUIRE(run(simulation, 1000));
    CHECK(simulation.state()[air(simulation).at(0)] == 3);
    CHECK(simulation.state()[air(simulation).at(2)] == -1);
    // v' = c/m (w - v), v(0) = 0
    CHECK(simulation.velocity(0).x() == Approx(3 * (1 - std::exp(-2.0))).epsilon(1e-6));
    CHECK(simulation.position(0).z() == Approx(-(1 - (1 - std::exp(-2.0)) / 2)).epsilon(1e-6));
  }
}

TEST_CASE("methods keep their order on forces with a memory") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_dust(1.5);
  const double time = 1.6;
  const auto exact = end_of(spec, registry, {.integrator = {"rk4"}, .dt = time / 16384}, time);
  const auto order = [&](const char* method, int steps) {
    const auto error = [&](int count) {
      return worst(end_of(spec, registry, {.integrator = {method}, .dt = time / count}, time),
                   exact);
    };
    INFO(method << " " << error(steps) << " " << error(2 * steps));
    CHECK(error(steps) > 1e-12);
    return std::log2(error(steps) / error(2 * steps));
  };
  CHECK(order("rk4", 64) == Approx(4).margin(0.3));
  CHECK(order("verlet", 128) == Approx(2).margin(0.2));
  CHECK(order("pefrl", 64) == Approx(4).margin(0.4));
  CHECK(order("implicit_midpoint", 128) == Approx(2).margin(0.2));
  CHECK(order("implicit_euler", 1024) == Approx(1).margin(0.15));
  CHECK(order("bdf2", 128) == Approx(2).margin(0.3));
}

TEST_CASE("a gust has the mean and the strength asked for, and other seeds other gusts") {
  sim::Registry registry = make_registry();
  const auto of = [&](std::int64_t seed) {
    sim::SystemSpec spec = make_dust(2);
    spec.forces[0].given["tau"] = 0.01;
    spec.forces[0].given["seed"] = seed;
    return spec;
  };
  sim::Simulation simulation(of(1), registry, {.integrator = {"rk4"}, .dt = 2e-3});
  double sum = 0, squares = 0;
  constexpr int kSteps = 50000;
  for (int n = 0; n < kSteps; ++n) {
    REQUIRE(simulation.step());
    const double w = simulation.state()[air(simulation).at(1)];
    sum += w;
    squares += w * w;
  }
  // The lag takes a part of the strength: w is smoother than the breeze it follows.
  CHECK(std::abs(sum / kSteps) < 0.05);
  CHECK(std::sqrt(squares / kSteps) > 1.2);
  CHECK(std::sqrt(squares / kSteps) < 2);
  CHECK(end_of(of(1), registry, {.dt = 1e-3}, 0.1) == end_of(of(1), registry, {.dt = 1e-3}, 0.1));
  CHECK(end_of(of(1), registry, {.dt = 1e-3}, 0.1) != end_of(of(2), registry, {.dt = 1e-3}, 0.1));
}

TEST_CASE("a memory takes part in the hash, in snapshots, checkpoints and travels in time") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_flag(6);
  for (const char* method : {"rk4", "verlet", "dopri5", "bdf2"}) {
    INFO(method);
    const sim::RunOptions options{.integrator = {method}, .dt = 2e-3};
    sim::Simulation whole(spec, registry, options), part(spec, registry, options);
    REQUIRE(run(whole, 150));
    REQUIRE(run(part, 90));
    sim::Simulation resumed(spec, registry, {.dt = 0.5});
    const auto saved = sim::decode(sim::encode({"", {}, 0, {sim::checkpoint(part, spec, 0)}}), "f");
    sim::resume(resumed, spec, saved.systems.front(), registry);
    REQUIRE(run(resumed, 60));
    CHECK(resumed.hash() == whole.hash());
    CHECK_FALSE(sim::first_difference(resumed, whole));

    sim::Timeline timeline(part);
    while (part.step_count() < 150) REQUIRE(timeline.step(part));
    CHECK(part.hash() == whole.hash());
    REQUIRE(timeline.go_to(part, 101, [] { return true; }));
    REQUIRE(timeline.go_to(part, 150, [] { return true; }));
    CHECK(part.hash() == whole.hash());

    // The memory alone makes another state.
    sim::Snapshot other = whole.snapshot();
    other.x[air(whole).at(1)] += 0.25;
    resumed.restore(other);
    CHECK(resumed.hash() != whole.hash());
    const auto difference = sim::first_difference(resumed, whole);
    REQUIRE(difference);
    CHECK(difference->item == "memory of 'gust'");
    CHECK(difference->id == 1);
    whole.reset();
    CHECK(whole.state()[air(whole).at(2)] == 2);
  }
}

TEST_CASE("forces with a memory give the same bits on any number of threads") {
  sim::Registry registry = make_registry();
  for (const char* method : {"rk4", "verlet", "implicit_midpoint"}) {
    INFO(method);
    const auto with = [&](int threads) {
      sim::Simulation simulation(make_flag(72), registry,
                                 {.integrator = {method}, .dt = 1e-3, .threads = threads});
      REQUIRE(run(simulation, 5));
      return simulation.hash();
    };
    CHECK(with(1) == with(2));
  }
}

TEST_CASE("a memory that is not finite is named") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_dust(1);
  spec.forces[0].given["tau"] = 1e-6;
  sim::Simulation simulation(spec, registry, {.integrator = {"euler"}, .dt = 0.1});
  CHECK_FALSE(run(simulation, 1000));
  CHECK(simulation.divergence().item == "memory of 'gust'");
}
