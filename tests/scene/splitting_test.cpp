// Symplectic splitting methods: energy, reversibility, exact drag, the limit of stability.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

const std::string kMethods[] = {"symplectic_euler", "verlet", "pefrl", "yoshida4"};

// A scene with one more force that is always 0: with it no acceleration is kept from step to step.
sim::SystemSpec with_zero_force(sim::SystemSpec spec) {
  spec.forces.push_back(make_part("attraction", {{"k", 0.0}}));
  return spec;
}

sim::Registry registry_with_attraction() {
  return sim::Registry({SIM_PLUGIN_DIR}, {SIM_FIXTURE_DIR "/attraction/attraction.so"});
}

}  // namespace

TEST_CASE("drag alone is exact at any step size") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_falling(0.5, 3);  // gamma = 6 1/s
  spec.particles->list[0].velocity = {7, 2, 0};
  for (const std::string& method : kMethods)
    for (const double h : {0.001, 0.1, 1.0, 20.0}) {
      // A long kick backwards in time multiplies rounding errors by e^(1.7 gamma h).
      if (method == "yoshida4" && h > 1) continue;
      sim::Simulation simulation(spec, registry, {.integrator = method, .dt = h});
      REQUIRE(run(simulation, 3));
      const double t = 3 * h, terminal = -kGravity / 6;
      INFO(method << ", h = " << h);
      CHECK(simulation.velocity(0).x() ==
            Approx(7 * std::exp(-6 * t)).epsilon(1e-13).margin(1e-16));
      CHECK(simulation.velocity(0).y() ==
            Approx(terminal + (2 - terminal) * std::exp(-6 * t)).epsilon(1e-13));
    }
}

TEST_CASE("energy stays bounded over a million steps") {
  sim::Registry registry = make_registry();
  // omega = sqrt(40) rad/s, h omega = 0.13; the energy error is of order (h omega)^p of some
  // joules.
  for (const std::string& method : kMethods) {
    sim::Simulation simulation(make_elastic_pendulum(), registry,
                               {.integrator = method, .dt = 0.02});
    const double start = simulation.energy().total();
    double early = 0, late = 0;
    for (int n = 0; n < 1000000; ++n) {
      REQUIRE(simulation.step());
      if (n % 10 != 0) continue;
      double& worst = n < 100000 ? early : late;
      worst = std::max(worst, std::fabs(simulation.energy().total() - start));
    }
    INFO(method << ": " << early << " J in the first tenth, " << late << " J after it");
    CHECK(late < 1.1 * early);
    CHECK(early < (method == "symplectic_euler" ? 1.5 : method == "verlet" ? 0.2 : 0.01));
  }
}

TEST_CASE("symmetric methods run backwards to where they came from") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_cloth(6, {.drag = 0});
  for (const std::string method : {"verlet", "pefrl", "yoshida4"}) {
    sim::Simulation there(spec, registry, {.integrator = method, .dt = 0.002});
    REQUIRE(run(there, 500));
    sim::SystemSpec back = spec;
    back.particles->grid.reset();
    for (int i = 0; i < there.particles(); ++i)
      back.particles->list.push_back({.position = there.position(i),
                                      .velocity = -there.velocity(i),
                                      .mass = spec.particles->at(i).mass});
    sim::Simulation home(back, registry, {.integrator = method, .dt = 0.002});
    REQUIRE(run(home, 500));
    double worst = 0;
    for (int i = 0; i < home.particles(); ++i)
      worst = std::max(worst, (home.position(i) - spec.particles->at(i).position).norm());
    INFO(method);
    CHECK(worst < 1e-10);
  }
}

TEST_CASE("the acceleration kept from step to step is the one that would be computed") {
  sim::Registry registry = registry_with_attraction();
  for (const std::string& method : kMethods) {
    sim::Simulation kept(make_elastic_pendulum(0.3), registry, {.integrator = method});
    sim::Simulation fresh(with_zero_force(make_elastic_pendulum(0.3)), registry,
                          {.integrator = method});
    REQUIRE(run(kept, 100));
    REQUIRE(run(fresh, 100));
    CHECK(kept.hash() == fresh.hash());

    sim::SystemSpec masses = make_chain({{0, 0, 0}, {0.3, 0, 0}, {0.6, 0.1, 0}}, {0}, 0.3);
    masses.particles->list[1].mass = 1.5;
    sim::Simulation two(masses, registry, {.integrator = method, .dt = 1e-3});
    sim::Simulation fresh_two(with_zero_force(masses), registry,
                              {.integrator = method, .dt = 1e-3});
    REQUIRE(run(two, 100));
    REQUIRE(run(fresh_two, 100));
    CHECK(two.hash() == fresh_two.hash());
  }
}

TEST_CASE("a reset forgets the acceleration of the last step") {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(make_cloth(9), registry, {.integrator = "verlet", .dt = 0.001});
  REQUIRE(run(simulation, 37));
  const std::uint64_t first = simulation.hash();
  REQUIRE(run(simulation, 5));
  simulation.reset();
  REQUIRE(run(simulation, 37));
  CHECK(simulation.hash() == first);
}

TEST_CASE("splittings refuse a system without their structure") {
  sim::Registry registry = make_registry();
  registry.load(SIM_FIXTURE_DIR "/air_drag/air_drag.so");
  sim::SystemSpec windy = make_falling(1, 0);
  windy.forces.push_back(make_part("air_drag", {{"c", 0.1}}));
  for (const std::string& method : kMethods) {
    CHECK_THROWS_WITH(sim::Simulation(make_circle(), registry, {.integrator = method}),
                      Catch::Contains("first order"));
  }
  for (const std::string method : {"pefrl", "yoshida4"})
    CHECK_THROWS_WITH(sim::Simulation(windy, registry, {.integrator = method}),
                      Catch::Contains("depends on velocity"));
}

TEST_CASE("kicks under forces of velocity are midpoint steps: methods keep their order") {
  sim::Registry registry = make_registry();
  registry.load(SIM_FIXTURE_DIR "/air_drag/air_drag.so");
  for (const double drag : {0.0, 0.3}) {
    sim::SystemSpec windy = make_elastic_pendulum(drag);
    windy.forces.push_back(make_part("air_drag", {{"c", 0.4}}));
    const auto end = [&](const std::string& method, int steps) {
      sim::Simulation simulation(windy, registry, {.integrator = method, .dt = 1.0 / steps});
      REQUIRE(run(simulation, steps));
      return simulation.position(1);
    };
    const sim::Vec3 exact = end("rk4", 4000);
    for (const auto& [method, order] :
         std::vector<std::pair<std::string, int>>{{"symplectic_euler", 1}, {"verlet", 2}}) {
      INFO(method << ", drag " << drag);
      const double coarse = (end(method, 400) - exact).norm();
      const double fine = (end(method, 800) - exact).norm();
      CHECK(std::log2(coarse / fine) == Approx(order).margin(0.1));
    }
  }
}
