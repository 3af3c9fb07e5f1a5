// Free fall and terminal speed: closed forms of the motion and of each method's discrete path.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

const sim::Vec3 kStart(0.5, 2, -1), kVelocity(1, 3, -2), kG(0, -kGravity, 0);

}  // namespace

TEST_CASE("free fall is a parabola") {
  sim::Registry registry = make_registry();
  for (const std::string method : {"euler", "trapezoid", "rk4"}) {
    sim::Simulation simulation(make_falling(3, 0), registry, {.integrator = method, .dt = 0.01});
    REQUIRE(run(simulation, 150));
    const double t = 1.5;
    // Euler lags by half a step: it takes g t (t - h) / 2.
    const double fallen = method == "euler" ? t * (t - 0.01) / 2 : t * t / 2;
    const sim::Vec3 x = kStart + t * kVelocity + fallen * kG;
    INFO(method);
    CHECK((simulation.position(0) - x).norm() <= 1e-12);
    CHECK((simulation.velocity(0) - kVelocity - t * kG).norm() <= 1e-12);
    const sim::Energy energy = simulation.energy();
    CHECK(energy.potential == Approx(3 * kGravity * simulation.position(0).y()).epsilon(1e-14));
    CHECK(energy.kinetic == Approx(1.5 * simulation.velocity(0).squaredNorm()).epsilon(1e-14));
  }
}

TEST_CASE("drag brings a falling particle to its terminal speed") {
  sim::Registry registry = make_registry();
  const double mass = 2, drag = 0.8, rate = drag / mass;
  const sim::Vec3 terminal = kG / rate;
  sim::Simulation simulation(make_falling(mass, drag), registry, {.dt = 0.01});

  REQUIRE(run(simulation, 300));
  const double decay = std::exp(-rate * 3);
  const sim::Vec3 v = terminal + decay * (kVelocity - terminal);
  const sim::Vec3 x = kStart + 3 * terminal + (1 - decay) / rate * (kVelocity - terminal);
  CHECK((simulation.velocity(0) - v).norm() <= 1e-10);
  CHECK((simulation.position(0) - x).norm() <= 1e-10);

  REQUIRE(run(simulation, 10000));
  CHECK((simulation.velocity(0) - terminal).norm() <= 1e-12 * terminal.norm());
}

TEST_CASE("each method damps the speed by R(-h c / m) a step") {
  sim::Registry registry = make_registry();
  const double z = -0.3;
  const std::pair<const char*, double> factors[] = {
      {"euler", 1 + z},
      {"trapezoid", 1 + z + z * z / 2},
      {"rk4", 1 + z + z * z / 2 + z * z * z / 6 + z * z * z * z / 24}};
  for (const auto& [method, factor] : factors) {
    sim::Simulation simulation(make_falling(2, 6), registry, {.integrator = method, .dt = 0.1});
    REQUIRE(run(simulation, 20));
    const sim::Vec3 terminal = kG / 3;
    const sim::Vec3 v = terminal + std::pow(factor, 20) * (kVelocity - terminal);
    INFO(method);
    CHECK((simulation.velocity(0) - v).norm() <= 1e-13);
  }
}

TEST_CASE("mass does not change a free fall, and divides the drag") {
  sim::Registry registry = make_registry();
  sim::Simulation light(make_falling(1e-3, 1e-3), registry),
      heavy(make_falling(1e3, 1e3), registry);
  REQUIRE(run(light, 100));
  REQUIRE(run(heavy, 100));
  CHECK((light.position(0) - heavy.position(0)).norm() <= 1e-13);
  CHECK(heavy.energy().kinetic == Approx(1e6 * light.energy().kinetic).epsilon(1e-13));
}

// v = v_0 e^(-k t / m) of those that the drag is kept to, v_0 of the others, for every k.
TEST_CASE("drag that is kept to some particles slows these alone, whatever it is") {
  sim::Registry registry = make_registry();
  for (const double k : {0.0, 0.3, 1.0, 2.0})
    for (const char* method : {"rk4", "verlet", "dopri5", "implicit_midpoint"}) {
      CAPTURE(k, method);
      sim::SystemSpec spec = make_falling(1, 0);
      spec.particles->list.clear();
      for (int i = 0; i < 11; ++i)
        spec.particles->list.push_back(
            {.position = {1.0 * i, 0, 0}, .velocity = {1, 2, 3}, .mass = 1.0 + i});
      sim::PartSpec drag = make_drag(k);
      drag.particles = std::vector<int>{1, 2, 7, 10};
      spec.forces = {drag};
      sim::Simulation system(spec, registry, {.integrator = method, .dt = 0.01});
      REQUIRE(run(system, 50));
      for (int i = 0; i < 11; ++i) {
        const bool slowed = std::ranges::count(*drag.particles, i) > 0;
        const double left = slowed ? std::exp(-k * 0.5 / (1 + i)) : 1;
        CHECK((system.velocity(i) - left * sim::Vec3(1, 2, 3)).norm() < 1e-5);
      }
    }
}
