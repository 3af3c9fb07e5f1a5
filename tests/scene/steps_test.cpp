// Several steps at once: the bits, the failures and the changes in between are those of single
// steps.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/ode/explicit/splitting.h"
#include "tests/support/allocations.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

sim::RunOptions with(const std::string& method, double dt, bool single = false, int threads = 1) {
  sim::RunOptions options{.integrator = method, .dt = dt, .threads = threads};
  if (single) options.integrator.given["precision"] = std::string("single");
  return options;
}

// The number of steps taken at once if allowed; a method with settings of its own takes those.
int at_once(const sim::SystemSpec& spec, sim::Registry& registry, const sim::RunOptions& options) {
  return sim::Simulation(spec, registry, options).steps(1000);
}

// n steps, as many at once as the method likes, with pieces of other lengths between them.
bool run_at_once(sim::Simulation& simulation, std::int64_t n) {
  for (std::int64_t piece = 1; n > 0; piece = piece % 11 + 1) {
    const int taken = simulation.steps(std::min(n, piece));
    if (taken == 0) return false;
    REQUIRE(taken <= std::min(n, piece));
    n -= taken;
  }
  return true;
}

sim::SystemSpec with_masses(sim::SystemSpec spec) {
  std::vector<sim::ParticleSpec> list;
  for (int i = 0; i < spec.particles->count(); ++i) {
    list.push_back(spec.particles->at(i));
    list.back().mass *= 1 + 0.25 * (i % 3);
    list.back().velocity = {0.01 * (i % 5), 0, 0.02};
  }
  spec.particles->grid.reset();
  spec.particles->list = list;
  return spec;
}

// With some ties that fit no run.
sim::SystemSpec with_net(sim::SystemSpec spec) {
  sim::PartSpec ties = make_springs("net", 3);
  const int n = spec.particles->count();
  for (int i = 0; i < 40; ++i) {
    const int a = i * i % n, b = (7 * i * i + 13) % (n - 1) + 1;
    if (a != b) ties.elements.add({a, b}, {{"stiffness", 3}, {"rest", 0.2}});
  }
  spec.forces.push_back(ties);
  return spec;
}

}  // namespace

TEST_CASE("several steps at once have the bits of single ones") {
  sim::Registry registry = make_registry();
  const auto check = [&](const sim::SystemSpec& spec, const sim::RunOptions& options, int most) {
    sim::Simulation one(spec, registry, options), many(spec, registry, options);
    INFO(spec.name << " of " << one.particles() << ", " << options.integrator.name << ", "
                   << options.threads.most << " threads");
    REQUIRE(at_once(spec, registry, options) == most);
    REQUIRE(run(one, 61));
    REQUIRE(run_at_once(many, 61));
    CHECK(many.step_count() == 61);
    CHECK(many.t() == one.t());
    CHECK(many.hash() == one.hash());
    CHECK(many.integrator().effort().steps == one.integrator().effort().steps);
    CHECK(many.integrator().effort().evaluations == one.integrator().effort().evaluations);
  };
  const double h = 1e-4;
  for (const int threads : {1, 2, 3})
    for (const int n : {2, 9, 40, 97}) {
      check(make_cloth(n), with("verlet", h, false, threads), 8);
      if (n == 2) continue;  // too few springs for runs
      check(make_cloth(n), with("verlet", h, true, threads), 8);
      check(make_cloth(n), with("rk4", h, true, threads), 8);
      check(make_cloth(n), with("pefrl", h, n == 40, threads), 3);
      check(make_cloth(n), with("yoshida4", h, n == 9, threads), 4);
      check(make_cloth(n), with("symplectic_euler", h, true, threads), 16);
    }
  check(make_cloth(12), with("rk4", h), 1);
  check(make_cloth(12), with("symplectic_euler", h), 1);
  check(with_masses(make_cloth(12)), with("verlet", h), 8);
  check(with_masses(make_cloth(95)), with("verlet", h, false, 2), 8);
  check(with_net(make_cloth(12)), with("verlet", h), 8);
  check(with_net(with_masses(make_cloth(95))), with("verlet", h, false, 2), 8);
  check(with_net(make_cloth(12)), with("pefrl", h), 3);
  // Other forces may read the time.
  registry.load(SIM_FIXTURE_DIR "/attraction/attraction.so");
  sim::SystemSpec attracted = make_cloth(12);
  attracted.forces.push_back(make_part("attraction", {{"k", 0.1}}));
  for (const char* method : {"verlet", "pefrl", "rk4"}) check(attracted, with(method, h), 1);
  // The slant of eight steps takes more particles than three threads have.
  std::vector<sim::Vec3> points;
  for (int i = 0; i < 9000; ++i) points.emplace_back(0.2 * i, std::sin(0.01 * i), 0);
  sim::SystemSpec rope = make_chain(points, {0, 8999}, 0.1);
  for (int i = 0; i + 700 < 9000; ++i)
    rope.forces[1].elements.add({i, i + 700}, {{"stiffness", 3}, {"rest", 140}});
  for (const int threads : {1, 2, 3, 4}) check(rope, with("verlet", h, threads == 4, threads), 8);
  // In two steps of verlet each.
  check(make_cloth(12, {.drag = 0}), {.integrator = {"auto", {{"tol", 1e-2}}}, .dt = 5e-3}, 4);
  check(make_circle(), with("rk4", h), 1);
}

TEST_CASE("methods that kick more than twice a step take several at once too") {
  sim::Registry registry = make_registry();
  sim::IntegratorPlugin plugin;
  plugin.name = "three_kicks";
  plugin.make = [](const sim::Params&) {
    return std::make_unique<sim::Splitting>(
        sim::Composition<3>{.drift = {0, 0.5, 0.5, 0}, .kick = {0.25, 0.5, 0.25}});
  };
  sim::Simulation one(make_cloth(95), registry, {.dt = 1e-4}),
      many(make_cloth(95), registry, {.dt = 1e-4}), probe(make_cloth(95), registry, {.dt = 1e-4});
  for (sim::Simulation* each : {&one, &many, &probe})
    each->set_integrator(sim::Method(registry, plugin));
  REQUIRE(probe.steps(1000) == 5);
  REQUIRE(run(one, 33));
  REQUIRE(run_at_once(many, 33));
  CHECK(many.hash() == one.hash());
}

TEST_CASE("a run that leaves the finite numbers stops in that step, several at once or not") {
  sim::Registry registry = make_registry();
  const auto check = [&](const sim::SystemSpec& spec, const sim::RunOptions& options) {
    sim::Simulation one(spec, registry, options), many(spec, registry, options);
    INFO(options.integrator.name << " on " << options.threads.most);
    REQUIRE(at_once(spec, registry, options) > 1);
    CHECK_FALSE(run(one, 100000));
    CHECK_FALSE(run_at_once(many, 100000));
    CHECK(many.step_count() == one.step_count());
    CHECK(many.step_count() > 8);
    CHECK(many.hash() == one.hash());
    CHECK(many.divergence().step == one.divergence().step);
    CHECK(many.divergence().particle == one.divergence().particle);
    CHECK(many.divergence().quantity == one.divergence().quantity);
    CHECK(many.steps(100) == 0);
    CHECK(many.hash() == one.hash());
  };
  for (const int threads : {1, 2}) {
    check(make_cloth(40), with("verlet", 0.02, false, threads));
    check(make_cloth(40), with("verlet", 0.02, true, threads));
    check(make_cloth(40), with("rk4", 0.004, true, threads));
    check(make_cloth(97), with("verlet", 0.02, false, threads));
  }
  // The run overflows at 1.2 s. The choice of auto for a spring compressed to 1 cm stays: after a
  // failed step it would choose longer steps.
  sim::SystemSpec far = make_chain({{0, 0, 0}, {0.01, 0, 0}, {5, 0, 0}}, {}, 0);
  far.forces[1].elements = {};
  far.forces[1].elements.add({0, 1}, {{"rest", 0.25}});
  far.particles->list[2].velocity = {1.5e308, 0, 0};
  check(far, {.integrator = {"auto", {{"tol", 1e-2}}}, .dt = 0.02});
}

TEST_CASE("what is changed between several steps at once is seen") {
  sim::Registry registry = make_registry();
  for (const bool single : {false, true}) {
    sim::Simulation one(make_cloth(12), registry, with("verlet", 1e-3, single));
    sim::Simulation many(make_cloth(12), registry, with("verlet", 1e-3, single));
    const auto both = [&](const auto& change) {
      change(one);
      change(many);
      REQUIRE(run(one, 20));
      REQUIRE(run_at_once(many, 20));
      CHECK(many.hash() == one.hash());
    };
    both([](sim::Simulation&) {});
    both([](sim::Simulation& s) { s.set_position(40, {0.5, 0.25, 0.5}); });
    both([](sim::Simulation& s) { s.set_velocity(41, {0, 1, 0}); });
    both([](sim::Simulation& s) { s.set_dt(5e-4); });
    both([](sim::Simulation& s) { s.set_pinned(60, true); });
    both([](sim::Simulation& s) { s.restore(s.snapshot()); });
    both([](sim::Simulation& s) { s.reset(); });
  }
}

TEST_CASE("a step of another size needs no restart") {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(make_cloth(12), registry, with("verlet", 1e-3));
  sim::Splitting verlet(sim::Composition<2>{.drift = {0, 1, 0}, .kick = {0.5, 0.5}});
  verlet.prepare(simulation.ode());
  const auto end_of = [&](bool restarts) {
    sim::Array x[3];
    for (sim::Array& state : x) state = sim::Array(simulation.state().size());
    std::ranges::copy(simulation.state(), x[0].data());
    verlet.restart(0, 1e-3, x[0].data());
    verlet.step(simulation.ode(), 0, 1e-3, x[0].data(), x[1].data());
    if (restarts) verlet.restart(1e-3, 5e-4, x[1].data());
    verlet.step(simulation.ode(), 1e-3, 5e-4, x[1].data(), x[2].data());
    return std::vector<double>(x[2].span().begin(), x[2].span().end());
  };
  CHECK(same_bits(end_of(false), end_of(true)));
}

TEST_CASE("several steps at once take no memory after the first") {
  sim::Registry registry = make_registry();
  for (const bool single : {false, true})
    for (const std::string method : {"verlet", "rk4"}) {
      sim::Simulation simulation(make_cloth(40), registry, with(method, 1e-4, single, 2));
      REQUIRE(simulation.steps(1) == 1);
      const std::size_t before = allocation_count();
      for (int n = 0; n < 20; ++n) simulation.steps(8);
      CHECK(allocation_count() == before);
      CHECK(simulation.step_count() > 20);
    }
}
