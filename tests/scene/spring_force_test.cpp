// The spring force: minus the gradient of its energy, and right at the extremes.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// Free particles of 1 kg at rest. One Euler step of 1 s then gives each the force as its velocity.
sim::SystemSpec make_points(const std::vector<sim::Vec3>& points) {
  sim::SystemSpec spec;
  spec.name = "points";
  spec.integrator = "euler";
  spec.dt = 1;
  spec.particles.emplace();
  for (const sim::Vec3& point : points) spec.particles->list.push_back({.position = point});
  spec.forces = {make_springs("spring", 1)};
  return spec;
}

std::vector<sim::Vec3> forces_of(const sim::SystemSpec& spec, sim::Registry& registry) {
  sim::Simulation simulation(spec, registry);
  REQUIRE(simulation.step());
  std::vector<sim::Vec3> forces;
  for (int i = 0; i < simulation.particles(); ++i) forces.push_back(simulation.velocity(i));
  return forces;
}

// -k (|d| - r) d / |d| with the exponent range and digits of long double.
sim::Vec3 exact_force(const sim::Vec3& d, double k, double rest) {
  const long double x = d[0], y = d[1], z = d[2];
  const long double length = std::sqrt(x * x + y * y + z * z);
  const long double factor = -k * (length - rest) / length;
  return {static_cast<double>(factor * x), static_cast<double>(factor * y),
          static_cast<double>(factor * z)};
}

}  // namespace

TEST_CASE("the spring force is minus the gradient of the energy") {
  sim::Registry registry = make_registry();
  const int n = 6;
  sim::SystemSpec spec = make_cloth(n, {.gravity = false, .pinned = false, .drag = 0});
  std::vector<sim::ParticleSpec> list;
  for (int i = 0; i < n * n; ++i) {
    list.push_back(spec.particles->at(i));
    list.back().mass = 1;
    list.back().position +=
        0.05 * sim::Vec3(std::sin(1.0 + 5 * i), std::sin(2.0 + 3 * i), std::sin(3.0 + 7 * i));
  }
  spec.particles->grid.reset();
  spec.particles->list = list;
  spec.integrator = "euler";
  spec.dt = 1;
  const std::vector<sim::Vec3> forces = forces_of(spec, registry);

  const double step = 1e-5;  // m; the differences are then good to about 1e-9
  const auto energy_at = [&](int i, int axis, double offset) {
    sim::SystemSpec moved = spec;
    moved.particles->list[static_cast<std::size_t>(i)].position[axis] += offset;
    return sim::Simulation(moved, registry).energy().potential;
  };
  for (int i = 0; i < n * n; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double slope = (energy_at(i, axis, step) - energy_at(i, axis, -step)) / (2 * step);
      INFO("particle " << i << " axis " << axis);
      CHECK(forces[static_cast<std::size_t>(i)][axis] == Approx(-slope).margin(1e-7));
    }
}

TEST_CASE("a spring of no length pulls only when its rest length is 0") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_points({{1, 2, 3}, {1, 2, 3}, {4, 5, 6}});
  spec.forces[0].elements = {};
  spec.forces[0].elements.add({0, 1}, {{"stiffness", 10}, {"rest", 1}});
  for (const sim::Vec3& force : forces_of(spec, registry)) CHECK(force == sim::Vec3::Zero());

  // Rest length 0: exactly -k d, at any distance.
  spec.forces[0].elements = {};
  spec.forces[0].elements.add({0, 1}, {{"stiffness", 10}, {"rest", 0}});
  spec.forces[0].elements.add({0, 2}, {{"stiffness", 3}, {"rest", 0}});
  const std::vector<sim::Vec3> forces = forces_of(spec, registry);
  CHECK(forces[0] == sim::Vec3(9, 9, 9));
  CHECK(forces[1] == sim::Vec3::Zero());
  CHECK(forces[2] == sim::Vec3(-9, -9, -9));
}

TEST_CASE("many springs of no length stay quiet in a run") {
  sim::Registry registry = make_registry();
  std::vector<sim::Vec3> points(40, sim::Vec3(0.3, -0.7, 11));
  sim::SystemSpec spec = make_points(points);
  for (int i = 0; i + 1 < 40; ++i)
    spec.forces[0].elements.add({i, i + 1}, {{"stiffness", 10}, {"rest", 0.5}});
  for (const sim::Vec3& force : forces_of(spec, registry)) CHECK(force == sim::Vec3::Zero());
}

TEST_CASE("forces are right for coordinates of any size") {
  sim::Registry registry = make_registry();
  const sim::Vec3 direction(1, -2, 0.5);
  // Lone springs and springs in a run go different ways; both have to hold.
  for (const int copies : {1, 40})
    for (const double size : {1e200, 1e160, 1e150, 1.0, 1e-150, 1e-160, 1e-200, 1e-300})
      for (const double rest : {0.0, 0.5, size}) {
        std::vector<sim::Vec3> points;
        for (int i = 0; i < copies; ++i) {
          points.push_back(sim::Vec3::Zero());
          points.push_back(size * direction);
        }
        sim::SystemSpec spec = make_points(points);
        for (int i = 0; i < copies; ++i)
          spec.forces[0].elements.add({2 * i, 2 * i + 1}, {{"stiffness", 7}, {"rest", rest}});
        const std::vector<sim::Vec3> forces = forces_of(spec, registry);
        const sim::Vec3 expected = exact_force(-size * direction, 7, rest);
        INFO("size " << size << " rest " << rest << " copies " << copies);
        for (std::size_t i = 0; i < points.size(); i += 2) {
          CHECK((forces[i] - expected).cwiseAbs().maxCoeff() <=
                1e-12 * expected.cwiseAbs().maxCoeff());
          CHECK(forces[i + 1] == -forces[i]);
        }
      }
}

TEST_CASE("huge and tiny springs share a scene") {
  sim::Registry registry = make_registry();
  std::vector<sim::Vec3> points;
  const double sizes[] = {1e200, 1, 1e-200, 3, 1e-300, 1e170, 0.1, 0};
  for (int i = 0; i < 64; ++i) {
    points.emplace_back(0, 0, 0);
    points.emplace_back(sizes[i % 8], 0, sizes[i % 8]);
  }
  sim::SystemSpec spec = make_points(points);
  for (int i = 0; i < 64; ++i)
    spec.forces[0].elements.add({2 * i, 2 * i + 1}, {{"stiffness", 2}, {"rest", 0.25}});
  const std::vector<sim::Vec3> forces = forces_of(spec, registry);
  for (int i = 0; i < 64; ++i) {
    const double size = sizes[i % 8];
    const sim::Vec3 expected =
        size == 0 ? sim::Vec3::Zero() : exact_force({-size, 0, -size}, 2, 0.25);
    INFO("size " << size);
    CHECK((forces[static_cast<std::size_t>(2 * i)] - expected).cwiseAbs().maxCoeff() <=
          1e-12 * expected.cwiseAbs().maxCoeff());
  }
}
