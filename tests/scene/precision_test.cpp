// Steps in single precision: what they cost in digits, and that nothing else is lost.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/error.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

sim::RunOptions in_single(const std::string& method, double dt) {
  return {.integrator = {method, {{"precision", std::string("single")}}}, .dt = dt};
}

double worst_difference(const sim::Simulation& a, const sim::Simulation& b) {
  double worst = 0;
  for (int i = 0; i < a.particles(); ++i)
    worst = std::max(worst, (a.position(i) - b.position(i)).norm());
  return worst;
}

// Two particles of 1 kg at a distance along x, tied three times over so that the springs make a
// run.
sim::SystemSpec make_pairs(double distance, double stiffness, double rest) {
  sim::SystemSpec spec = make_cloth(2);
  spec.particles->grid.reset();
  spec.particles->pinned.clear();
  spec.particles->list.clear();
  spec.forces = {make_springs("pair", stiffness)};
  for (int i = 0; i < 16; ++i)
    spec.particles->list.push_back({{i < 8 ? 0 : distance, i % 8 * 10.0, 0}, {0, 0, 0}, 1});
  for (int i = 0; i < 8; ++i)
    spec.forces[0].elements.add({i, i + 8}, {{"stiffness", stiffness}, {"rest", rest}});
  return spec;
}

std::string refusal(const sim::SystemSpec& spec, const std::string& method = "rk4") {
  sim::Registry registry = make_registry();
  try {
    sim::Simulation(spec, registry, in_single(method, 1e-3));
  } catch (const sim::Error& error) {
    CHECK(error.kind() == sim::ErrorKind::kScene);
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("single precision costs digits of a motion, not the motion") {
  sim::Registry registry = make_registry();
  for (const char* method : {"euler", "midpoint", "trapezoid", "rk3", "rk4", "symplectic_euler",
                             "verlet", "pefrl", "yoshida4"}) {
    INFO(method);
    const bool first = method == std::string("euler");
    const double dt = first ? 2e-5 : 1e-3;
    sim::Simulation whole(make_cloth(8), registry, {.integrator = method, .dt = dt});
    sim::Simulation half(make_cloth(8), registry, in_single(method, dt));
    REQUIRE(run(whole, 800));
    REQUIRE(run(half, 800));
    const double difference = worst_difference(whole, half);
    CHECK(difference > 1e-10);
    CHECK(difference < 5e-5);  // 1 m, rounded by 6e-8 up to seven times in each of 800 steps
    CHECK(half.integrator_info().precision == sim::Precision::kSingle);
  }
}

TEST_CASE("the force of a spring has the digits of single precision at any length") {
  sim::Registry registry = make_registry();
  // One step of symplectic Euler from rest: v = h f / m, f = k (d - rest) on the first particle.
  const double h = 0.0009765625, ulp = std::ldexp(1.0, -24);
  for (double distance = 1e-14; distance < 1e16; distance *= 1.0371) {
    sim::Simulation pair(make_pairs(distance, 3, 0.25), registry, in_single("symplectic_euler", h));
    REQUIRE(pair.step());
    const double d = static_cast<double>(static_cast<float>(distance));
    // The factor k rest / d - k is rounded where it stands, before d comes in.
    const double scale = 3 * h * std::max(d, 0.25);
    INFO(distance);
    CHECK(std::abs(pair.velocity(3).x() - 3 * h * (d - 0.25)) < 4 * ulp * scale);
    CHECK(pair.velocity(11).x() == -pair.velocity(3).x());
  }
  // No direction, no force, however strong the spring.
  for (const double stiffness : {3.0, 1e20}) {
    sim::Simulation together(make_pairs(0, stiffness, 1), registry, in_single("rk4", h));
    REQUIRE(run(together, 10));
    CHECK(together.velocity(3).norm() == 0);
  }
}

TEST_CASE("a run in single precision goes on from what it is given") {
  sim::Registry registry = make_registry();
  for (const char* method : {"rk4", "verlet", "pefrl"}) {
    INFO(method);
    sim::Simulation simulation(make_cloth(9), registry, in_single(method, 1e-3));
    REQUIRE(run(simulation, 30));
    const sim::Snapshot there = simulation.snapshot();
    REQUIRE(run(simulation, 31));
    const std::uint64_t end = simulation.hash();
    simulation.restore(there);
    REQUIRE(run(simulation, 31));
    CHECK(simulation.hash() == end);

    sim::Simulation other(make_cloth(9), registry);
    other.restore(there);
    CHECK(other.integrator_info().precision == sim::Precision::kSingle);
    REQUIRE(run(other, 31));
    CHECK(other.hash() == end);

    // A particle that was taken elsewhere is there in the next step.
    simulation.set_position(40, {0.5, 0.25, 0.5});
    REQUIRE(simulation.step());
    CHECK((simulation.position(40) - sim::Vec3(0.5, 0.25, 0.5)).norm() < 0.02);
    simulation.reset();
    sim::Simulation fresh(make_cloth(9), registry, in_single(method, 1e-3));
    REQUIRE(run(simulation, 5));
    REQUIRE(run(fresh, 5));
    CHECK(simulation.hash() == fresh.hash());
  }
}

TEST_CASE("single precision overflows to an error, and is refused where it cannot be had") {
  sim::Registry registry = make_registry();
  sim::Simulation fast(make_falling(1, 0), registry, in_single("rk4", 1e3));
  const sim::Vec3 start = fast.position(0);
  fast.set_velocity(0, {1e37, 0, 0});
  CHECK_FALSE(fast.step());
  CHECK(fast.divergence().status == sim::StepStatus::kNotFinite);
  CHECK(fast.position(0) == start);
  fast.set_velocity(0, {1, 0, 0});
  CHECK(fast.step());

  CHECK(refusal(make_cloth(8)).empty());
  CHECK(refusal(make_circle()).find("springs, gravity and drag") != std::string::npos);
  CHECK(refusal(make_circle(), "verlet").find("first order") != std::string::npos);
  CHECK(refusal(make_vertical_spring(0)).find("equal id differences") != std::string::npos);
  CHECK(refusal(make_pairs(1, 1e30, 1)).find("a stiffness of 1e+30") != std::string::npos);
  CHECK(refusal(make_pairs(1, 1e18, 1e18)).find("rest length of 1e+36") != std::string::npos);
  CHECK(refusal(make_falling(1e-30, 0)).find("a mass of 1e-30") != std::string::npos);
  CHECK(refusal(make_falling(1, 1e-30)).find("a drag of 1e-30") != std::string::npos);
  sim::SystemSpec heavy = make_falling(1, 0);
  heavy.forces[0].given["g"] = sim::Vec3(0, -1e21, 0);
  CHECK(refusal(heavy).find("an acceleration of -1e+21") != std::string::npos);
  sim::SystemSpec loaded = make_cloth(3);
  loaded.loads.assign(9, {0, 1, 0});
  CHECK(refusal(loaded).find("force 'load'") != std::string::npos);
  CHECK(refusal(make_cloth(8), "dopri5").find("no parameter 'precision'") != std::string::npos);
}
