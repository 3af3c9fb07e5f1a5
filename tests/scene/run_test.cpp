// Promises of every run: exact time, resets, threads that change nothing, divergence reported at
// once, pins that hold and steps that take no memory.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "tests/lua/scene_text.h"
#include "tests/support/allocations.h"
#include "tests/support/scenes.h"

using namespace sim_test;

TEST_CASE("time is the number of steps times the step size") {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(make_falling(1, 0.1), registry, {.dt = 0.1});
  for (std::int64_t n = 0; n < 12345; ++n) {
    if (simulation.t() != static_cast<double>(n) * 0.1) FAIL("step " << n);
    REQUIRE(simulation.step_count() == n);
    REQUIRE(simulation.step());
  }
  CHECK(simulation.h() == 0.1);
}

TEST_CASE("the number of steps is the least that reaches the duration") {
  sim::Registry registry = make_registry();
  const sim::Simulation tenth(make_circle(), registry, {.dt = 0.1});
  CHECK(tenth.steps_for(0) == 0);
  CHECK(tenth.steps_for(0.3) == 3);
  CHECK(tenth.steps_for(0.7) == 7);
  CHECK(tenth.steps_for(1.1) == 11);  // 1.1 / 0.1 is 11.000000000000002
  CHECK(tenth.steps_for(0.31) == 4);
  CHECK(tenth.steps_for(1e-9) == 1);
  const sim::Simulation fine(make_circle(), registry, {.dt = 1e-3});
  CHECK(fine.steps_for(1000) == 1000000);
  CHECK(fine.steps_for(1000.0005) == 1000001);
}

TEST_CASE("reset brings back the first bits and the same path") {
  sim::Registry registry = make_registry();
  for (const sim::SystemSpec& spec : {make_cloth(9), make_circle(), make_elastic_pendulum(1)}) {
    sim::Simulation simulation(spec, registry);
    const std::uint64_t start = simulation.hash();
    const std::vector<double> first = state_of(simulation);
    REQUIRE(run(simulation, 50));
    const std::uint64_t end = simulation.hash();
    CHECK(end != start);
    simulation.reset();
    CHECK(simulation.hash() == start);
    CHECK(simulation.step_count() == 0);
    CHECK(simulation.t() == 0);
    CHECK(same_bits(state_of(simulation), first));
    REQUIRE(run(simulation, 50));
    CHECK(simulation.hash() == end);
  }
}

TEST_CASE("every integrator takes the same path after a reset") {
  sim::Registry registry = make_registry();
  for (const sim::SystemSpec& spec : {make_cloth(6), make_circle(), make_elastic_pendulum(1)})
    for (const std::string& method : methods_for(spec, registry)) {
      INFO(spec.name << ", " << method);
      sim::Simulation simulation(spec, registry, {.integrator = method, .dt = 0.001});
      REQUIRE(run(simulation, 60));
      const std::uint64_t end = simulation.hash();
      simulation.reset();
      REQUIRE(run(simulation, 60));
      CHECK(simulation.hash() == end);
    }
}

TEST_CASE("a reset after a divergence is a fresh start") {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(make_cloth(4), registry, {.integrator = "euler"});
  const std::uint64_t start = simulation.hash();
  REQUIRE_FALSE(run(simulation, 100000));
  simulation.reset();
  CHECK(simulation.hash() == start);
  CHECK(simulation.step());
}

TEST_CASE("a run that diverged leaves nothing behind for the run after a reset") {
  sim::Registry registry = make_registry();
  int diverged = 0;
  for (const int n : {4, 7, 9, 50}) {
    const sim::SystemSpec spec = make_cloth(n);
    for (const std::string& method : methods_with_order(spec, registry)) {
      if (info_of(method, registry).implicit && n > 7) continue;  // they do not diverge
      INFO(method << " on " << n << " x " << n);
      sim::Simulation fresh(spec, registry, fixed_steps(method, 0.3, registry));
      sim::Simulation again(spec, registry, fixed_steps(method, 0.3, registry));
      diverged += !run(again, 100);
      again.reset();
      REQUIRE(run(again, 2));
      REQUIRE(run(fresh, 2));
      CHECK(again.hash() == fresh.hash());
    }
  }
  CHECK(diverged > 8);
}

TEST_CASE("the hash sees one bit and the number of steps") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_elastic_pendulum();
  const sim::Simulation simulation(spec, registry);
  spec.particles->list[1].velocity.z() = std::nextafter(spec.particles->list[1].velocity.z(), 1);
  CHECK(sim::Simulation(spec, registry).hash() != simulation.hash());

  // A particle at rest without forces keeps its state but not its hash.
  sim::SystemSpec still = make_falling(1, 0);
  still.forces.clear();
  still.particles->list[0].velocity = sim::Vec3::Zero();
  sim::Simulation standing(still, registry);
  const std::uint64_t start = standing.hash();
  REQUIRE(standing.step());
  CHECK(standing.hash() != start);
}

TEST_CASE("the bits do not depend on the number of threads") {
  sim::Registry registry = make_registry();
  const auto check = [&](const sim::SystemSpec& spec, const std::string& method, int steps = 100) {
    std::uint64_t first = 0;
    double energy = 0;
    for (const int threads : {1, 2, 3, 4, 7}) {
      sim::Simulation simulation(spec, registry,
                                 {.integrator = method, .dt = 0.0001, .threads = threads});
      REQUIRE(run(simulation, steps));
      if (threads == 1) {
        first = simulation.hash();
        energy = simulation.energy().total();
      }
      INFO(spec.name << " of " << simulation.particles() << " on " << threads << ", " << method);
      CHECK(simulation.hash() == first);
      CHECK(simulation.energy().total() == energy);
    }
  };
  for (const int n : {2, 3, 17, 40, 64}) check(make_cloth(n), "rk4");
  check(make_cloth(100), "rk4");
  for (const std::string& method : methods_for(make_cloth(2), registry))
    if (!info_of(method, registry).implicit) check(make_cloth(97), method, 5);

  // A long rope in which some springs skip particles, so that runs end in the middle of tiles.
  std::vector<sim::Vec3> points;
  for (int i = 0; i < 5000; ++i) points.emplace_back(0.2 * i, std::sin(0.01 * i), 0);
  sim::SystemSpec rope = make_chain(points, {0, 4999}, 0.1);
  for (int i = 0; i + 37 < 5000; i += 11)
    rope.forces[1].elements.add({i, i + 37}, {{"stiffness", 3}, {"rest", 5}});
  for (int i = 0; i < 100; ++i)
    rope.forces[1].elements.add({i * i % 4999, (7 * i * i + 13) % 4999 + 1},
                                {{"stiffness", 0.5}, {"rest", 100}});
  check(rope, "rk4");
}

TEST_CASE("pinned particles keep their bits and have no velocity") {
  sim::Registry registry = make_registry();
  const sim::Vec3 place(0.1, 1.0 / 3, -7e-17);
  sim::SystemSpec spec = make_elastic_pendulum(0.3);
  spec.particles->list[0].position = place;
  spec.particles->list[0].velocity = {1, -2, 3};
  for (const std::string& method : methods_for(spec, registry)) {
    sim::Simulation simulation(spec, registry, {.integrator = method});
    for (int n = 0; n < 1000; ++n) {
      const sim::Vec3 x = simulation.position(0);
      REQUIRE(std::memcmp(x.begin(), place.begin(), sizeof(double) * 3) == 0);
      REQUIRE(simulation.velocity(0) == sim::Vec3::Zero());
      REQUIRE(simulation.step());
    }
    CHECK(simulation.pinned_count() == 1);
  }
}

TEST_CASE("a run that leaves the finite numbers stops in that step") {
  sim::Registry registry = make_registry();
  for (const int threads : {1, 3}) {
    sim::Simulation simulation(make_cloth(40), registry,
                               {.integrator = "euler", .dt = 0.005, .threads = threads});
    std::vector<double> before;
    std::uint64_t hash = 0;
    do {
      before = state_of(simulation);
      hash = simulation.hash();
    } while (simulation.step());
    const std::int64_t n = simulation.step_count();
    REQUIRE(n > 10);

    // The state is the last finite one, and stays it.
    CHECK(same_bits(state_of(simulation), before));
    for (const double value : before) REQUIRE(std::isfinite(value));
    CHECK_FALSE(simulation.step());
    CHECK(simulation.hash() == hash);
    CHECK(simulation.t() == static_cast<double>(n) * 0.005);

    const sim::Divergence where = simulation.divergence();
    CHECK(where.step == n + 1);
    CHECK(where.t == static_cast<double>(n + 1) * 0.005);
    CHECK(where.h == 0.005);
    CHECK((where.particle > 0 && where.particle < 1600));
    CHECK((where.particle != 39));  // pinned
    CHECK_FALSE(where.quantity.empty());
  }
}

// x = 1e307 t m: the first of whole seconds beyond the largest number, 1.798e308, is 18 s.
TEST_CASE("each kind of stepper stops in the step in which numbers cease to be finite") {
  const char* const kRods = "constraints = { sim.constraint.distance { ties = { {1, 2} } } }, ";
  const char* const kFloor = "colliders = { sim.collider.plane { point = {0, -5, 0} } }, ";
  const std::string kinds[] = {
      "",
      kRods,
      kFloor,
      std::string(kRods) + kFloor,
      "forces = { sim.force.spring { stiffness = 0.1, damping = 0.1 }:tie(1, 2) }, ",
      "contact = sim.contact { surfaces = { sim.surface { particles = p, triangles = { {1, 2, 3} } "
      "} }, "
      "thickness = 0.01 }, "};
  for (const bool prescribed : {false, true})
    for (const std::string& kind : kinds)
      for (const char* const method : {"euler", "rk4", "symplectic_euler", "verlet", "yoshida4"}) {
        const bool split_4 = std::string(method) == "yoshida4";
        if (split_4 && kind.find("damping") != std::string::npos) continue;  // it does not fit
        INFO(kind << ", " << prescribed << ", " << method);
        sim::test::TextRun run(
            "local p = sim.particles { mass = 1 }\n"
            "p:add({0, 0, 0}, { velocity = {1e307, 0, 0} })\n"
            "p:add {0, 1, 0}\np:add {0, 2, 0}\np:add {1, 2, 0}\np:add {0, 4, 0}\n" +
                std::string(prescribed ? "p:prescribe(4, function(t) return {0, 4 + t, 0} end)\n"
                                       : "") +
                "local all = { " + kind +
                "particles = p, integrator = 'rk4', dt = 1, duration = 9 "
                "}\nall.forces = all.forces or {}\nreturn sim.scene(all)\n",
            method, 1);
        int steps = 0;
        while (steps < 30 && run.system.step()) ++steps;
        CHECK(steps == 17);
        CHECK(run.system.position(0).x() == Approx(17e307));
        CHECK(run.system.divergence().particle == 0);
        CHECK(run.system.divergence().quantity == "x");
      }
}

TEST_CASE("the first quantity that is not finite is named") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list.push_back(spec.particles->list[0]);
  spec.particles->list[1].position.z() = 1.7e308;
  spec.particles->list[1].velocity.z() = 1e308;
  sim::Simulation simulation(spec, registry, {.dt = 1});
  REQUIRE_FALSE(simulation.step());
  CHECK(simulation.divergence().particle == 1);
  CHECK(simulation.divergence().quantity == "z");
  CHECK(simulation.divergence().step == 1);

  // A velocity may be the first; that of the half step of verlet is below 1.795e308 then.
  spec = make_falling(1, 0);
  spec.forces[0].given["g"] = sim::Vec3(1e308, 0, 0);
  spec.particles->list[0].velocity.x() = 1.69e308;
  for (const std::string method : {"rk4", "verlet"}) {
    sim::Simulation fast(spec, registry, {.integrator = method, .dt = 0.03});
    INFO(method);
    CHECK_FALSE(run(fast, 10));
    CHECK(fast.step_count() == 3);
    CHECK(fast.divergence().quantity == "vx");
  }
}

TEST_CASE("a step after the first takes no memory") {
  sim::Registry registry = make_registry();
  const auto check = [&](const sim::SystemSpec& spec, const std::string& method, int threads) {
    sim::Simulation simulation(spec, registry,
                               {.integrator = method, .dt = 1e-4, .threads = threads});
    REQUIRE(simulation.step());
    const std::size_t before = allocation_count();
    for (int n = 0; n < 20; ++n) simulation.step();
    const std::size_t taken = allocation_count() - before;
    INFO(spec.name << ", " << method << ", " << threads << " threads");
    CHECK(taken == 0);
    CHECK(before > 0);
  };
  for (const std::string& method : methods_for(make_cloth(2), registry)) {
    check(make_cloth(10), method, 1);
    check(make_cloth(40), method, 3);
    check(make_elastic_pendulum(0.1), method, 1);
  }
  for (const std::string& method : methods_for(make_circle(), registry))
    check(make_circle(), method, 1);
}
