// The kernel against plain loops over all springs and stages: whatever way a scene takes through
// it, small or large, on one thread or several, the numbers are the same up to rounding.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/reference_model.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    REQUIRE(std::isfinite(a[i]));
    largest = std::max(largest, std::abs(a[i] - b[i]));
  }
  return largest;
}

// h in s is small enough for every method to be stable, so that rounding errors do not grow.
void check_against_plain(const sim::SystemSpec& spec, double h, double tolerance) {
  sim::Registry registry = make_registry();
  const int steps = 12;
  for (const std::string method : {"euler", "trapezoid", "rk4"}) {
    ReferenceModel plain(spec);
    for (int n = 0; n < steps; ++n) plain.step(method, h);
    for (const int threads : {1, 2, 5}) {
      sim::Simulation simulation(spec, registry,
                                 {.integrator = method, .dt = h, .threads = threads});
      REQUIRE(run(simulation, steps));
      INFO(spec.name << " of " << simulation.particles() << ", " << method << ", " << threads
                     << " threads");
      const double difference = largest_difference(state_of(simulation), plain.state());
      INFO("differs by " << difference);
      CHECK(difference <= tolerance);
    }
  }
}

// A cloth in motion, so that every spring pulls its own way.
sim::SystemSpec make_moving_cloth(int n, const ClothOptions& options = {}) {
  sim::SystemSpec spec = make_cloth(n, options);
  std::vector<sim::ParticleSpec> list;
  for (int i = 0; i < n * n; ++i) {
    list.push_back(spec.particles->at(i));
    list.back().velocity = {std::sin(1.0 + i), std::sin(2.0 + 3 * i), std::sin(3.0 + 7 * i)};
    list.back().position += 0.1 / n * list.back().velocity;
  }
  spec.particles->grid.reset();
  spec.particles->list = list;
  return spec;
}

}  // namespace

TEST_CASE("cloths of all sizes move as the plain loops say") {
  for (const int n : {2, 3, 5, 8, 13, 33, 50, 64, 100})
    check_against_plain(make_moving_cloth(n), 0.01 / n, 1e-11);
}

TEST_CASE("cloths without drag, without pins or with several masses move as the plain loops say") {
  check_against_plain(make_moving_cloth(40, {.drag = 0}), 2e-4, 1e-12);
  check_against_plain(make_moving_cloth(40, {.pinned = false}), 2e-4, 1e-12);
  for (const int n : {9, 95}) {
    sim::SystemSpec spec = make_moving_cloth(n);
    for (std::size_t i = 0; i < spec.particles->list.size(); ++i)
      spec.particles->list[i].mass *= 1 + static_cast<double>(i % 5);
    spec.particles->pinned = {0, 3, 4, n * n / 2, n * n - 1};
    check_against_plain(spec, 0.01 / n, 1e-11);
  }
}

TEST_CASE("ropes and irregular lattices move as the plain loops say") {
  std::vector<sim::Vec3> points;
  for (int i = 0; i < 9001; ++i) points.emplace_back(0.2 * i, std::sin(0.1 * i), std::cos(i));
  sim::SystemSpec rope = make_chain(points, {0, 9000}, 0.1);
  check_against_plain(rope, 1e-3, 1e-10);

  // Springs of all lengths and directions, some of them alone, some tied to the pinned ends.
  auto& ties = rope.forces[1].elements;
  for (int i = 0; i + 37 < 9001; i += 11) ties.add({i + 37, i}, {{"stiffness", 3}, {"rest", 5}});
  for (int i = 0; i < 200; ++i)
    ties.add({i * i % 9001, (i * i + 13 * i + 1) % 9001}, {{"stiffness", 0.5}, {"rest", 0.1 * i}});
  check_against_plain(rope, 1e-3, 1e-10);
}

TEST_CASE("a force of a plugin sees the time, the places and the velocities of each stage") {
  sim::Registry registry = make_registry();
  registry.load(std::string(SIM_FIXTURE_DIR) + "/air_drag/air_drag.so");
  sim::SystemSpec spec = make_falling(2, 0);
  spec.forces = {make_part("air_drag", {{"c", 0.6}})};
  sim::Simulation simulation(spec, registry, {.dt = 0.002});
  REQUIRE(run(simulation, 1000));
  // v' = -c/m (1 + t) |v| v:  1/|v| grows by c/m (t + t^2 / 2).
  const sim::Vec3 start(1, 3, -2);
  const double speed = 1 / (1 / start.norm() + 0.3 * (2 + 2));
  CHECK((simulation.velocity(0) - start.normalized() * speed).norm() <= 1e-11);

  // With springs of all kinds beside it, the order stays.
  sim::SystemSpec cloth = make_moving_cloth(5);
  cloth.forces.push_back(make_part("air_drag", {{"c", 0.01}}));
  const auto state_after = [&](int steps) {
    sim::Simulation run_of(cloth, registry, {.dt = 0.05 / steps});
    REQUIRE(run(run_of, steps));
    return state_of(run_of);
  };
  const std::vector<double> exact = state_after(4000);
  const double coarse = largest_difference(state_after(200), exact);
  const double fine = largest_difference(state_after(400), exact);
  INFO(coarse << " " << fine);
  CHECK(std::log2(coarse / fine) == Approx(4).margin(0.1));
}
