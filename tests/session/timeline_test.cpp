// Going back in time, and changes by hand: the same bits as a run that never left.
#include "core/session/timeline.h"

#include <catch2/catch.hpp>
#include <random>

#include "core/base/error.h"
#include "core/session/difference.h"
#include "tests/study/judged_run.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Simulation;
using sim::Timeline;

namespace {

const auto kOn = [] { return true; };

// Every integrator that can step this scene.
template <class Visit>
int with_each_integrator(const sim::SystemSpec& spec, double dt, Visit visit) {
  sim::Registry registry = make_registry();
  int count = 0;
  for (const std::string& name : registry.names<sim::Integrator>()) {
    std::optional<Simulation> simulation;
    try {
      simulation.emplace(spec, registry, sim::RunOptions{.integrator = name, .dt = dt});
    } catch (const sim::Error&) {
      continue;  // it does not fit
    }
    INFO(name);
    visit(registry, *simulation);
    ++count;
  }
  return count;
}

std::vector<std::uint64_t> hashes_of(Simulation& simulation, int steps) {
  std::vector<std::uint64_t> hashes{simulation.hash()};
  for (int i = 0; i < steps; ++i) {
    REQUIRE(simulation.step());
    hashes.push_back(simulation.hash());
  }
  return hashes;
}

}  // namespace

TEST_CASE("every step can be reached again bit for bit, with every integrator") {
  constexpr int kSteps = 300;
  const sim::SystemSpec scenes[] = {make_cloth(5), make_elastic_pendulum(), make_circle()};
  for (const sim::SystemSpec& scene : scenes) {
    INFO(scene.name);
    const int count = with_each_integrator(scene, 1e-4, [&](sim::Registry&, Simulation& sim) {
      const std::vector<std::uint64_t> hashes = hashes_of(sim, kSteps);
      sim.reset();
      Timeline timeline(sim);
      std::minstd_rand random(7);
      std::int64_t furthest = 0;
      for (int i = 0; i < 40; ++i) {
        const auto target = static_cast<std::int64_t>(random() % (kSteps + 1));
        REQUIRE(timeline.go_to(sim, target, kOn));
        CHECK(sim.step_count() == target);
        CHECK(sim.hash() == hashes[static_cast<std::size_t>(target)]);
        furthest = std::max(furthest, target);
        CHECK(timeline.last() == furthest);
      }
    });
    CHECK(count >= 4);
  }
}

TEST_CASE("a step that fails is no step of a timeline") {
  sim::Registry registry = make_registry();
  Simulation sim(make_elastic_pendulum(), registry, {.integrator = "euler", .dt = 1e200});
  Timeline timeline(sim);
  int taken = 0;
  while (taken < 100 && timeline.step(sim)) ++taken;
  CHECK(taken < 100);
  CHECK(sim.step_count() == taken);
  CHECK_FALSE(timeline.step(sim));
}

// The solution of x' = x^2 is x / (1 - x t), infinite at t = 1. A method does not use earlier what
// it knew where it failed.
TEST_CASE("after a step that fails an earlier state goes on with the same bits") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec =
      make_field({1, 0.5}, [](double, std::span<const double> x, std::span<double> d) {
        for (std::size_t i = 0; i < 2; ++i) d[i] = x[i] * x[i];
      });
  int failed = 0;
  for (const std::string& method : methods_for(spec, registry)) {
    CAPTURE(method);
    Simulation sim(spec, registry, {.integrator = {method}, .dt = 0.05});
    std::vector<sim::Snapshot> states{sim.snapshot()};
    while (states.size() < 60 && sim.step()) states.push_back(sim.snapshot());
    if (states.size() == 60) continue;
    ++failed;
    REQUIRE(states.size() > 5);
    for (const std::size_t back : {1, 2, 4}) {
      const std::size_t from = states.size() - 1 - back;
      sim.restore(states[from]);
      for (std::size_t n = from + 1; n < states.size(); ++n) {
        REQUIRE(sim.step());
        CHECK(same_bits({sim.state().begin(), sim.state().end()}, states[n].x));
      }
      CHECK_FALSE(sim.step());
    }
  }
  CHECK(failed > 8);
}

TEST_CASE("changes by hand are made again, and discarded by a change before them") {
  with_each_integrator(make_cloth(5), 1e-4, [](sim::Registry&, Simulation& sim) {
    Timeline timeline(sim);
    const auto go = [&](std::int64_t step) { REQUIRE(timeline.go_to(sim, step, kOn)); };
    go(70);
    timeline.edit(sim, [](Simulation& s) { s.set_velocity(12, {0.1, 0.2, 0.3}); });
    timeline.edit(sim, [](Simulation& s) { s.set_pinned(0, false); });
    go(100);
    timeline.edit(sim, [](Simulation& s) { s.set_dt(5e-5); });
    go(150);
    const std::uint64_t end = sim.hash();
    const double t = sim.t();
    CHECK(t == 100 * 1e-4 + 50 * 5e-5);
    CHECK(timeline.edits() == 2);

    go(20);
    CHECK(sim.h() == 1e-4);
    CHECK(sim.pinned(0));
    go(150);
    CHECK(sim.hash() == end);
    CHECK(sim.t() == t);
    CHECK_FALSE(sim.pinned(0));
    go(20);
    while (sim.step_count() < 150) REQUIRE(timeline.step(sim));
    CHECK(sim.hash() == end);
    CHECK(sim.t() == t);
    go(21);  // eight steps at once pass over both changes
    while (sim.step_count() < 150) REQUIRE(timeline.steps(sim, 150 - sim.step_count()) > 0);
    CHECK(sim.hash() == end);

    go(90);
    timeline.edit(sim, [](Simulation& s) { s.set_position(7, {0, 0, 0}); });
    CHECK(timeline.last() == 90);
    CHECK(timeline.edits() == 2);
    go(150);
    CHECK(sim.hash() != end);
    CHECK(sim.h() == 1e-4);

    // Undone, the run is the one of before the change.
    REQUIRE(timeline.undo(sim));
    CHECK(sim.step_count() == 90);
    timeline.edit(sim, [](Simulation& s) { s.set_dt(5e-5); });
    REQUIRE(timeline.undo(sim));
    go(100);
    timeline.edit(sim, [](Simulation& s) { s.set_dt(5e-5); });
    go(150);
    CHECK(sim.hash() == end);
    REQUIRE(timeline.undo(sim));
    REQUIRE(timeline.undo(sim));
    CHECK_FALSE(timeline.undo(sim));
    CHECK(sim.pinned(0));
  });
}

TEST_CASE("two changes at one step are taken back one by one where they are told apart") {
  sim::Registry registry = make_registry();
  Simulation sim(make_cloth(4), registry, {.integrator = "rk4", .dt = 0.001});
  Timeline timeline(sim);
  REQUIRE(timeline.go_to(sim, 10, kOn));
  const std::uint64_t before = sim.hash();
  timeline.edit(sim, [](Simulation& s) { s.set_velocity(5, {1, 0, 0}); });
  timeline.edit(sim, [](Simulation& s) { s.set_velocity(6, {1, 0, 0}); });
  const std::uint64_t one = sim.hash();
  timeline.part(sim);
  timeline.edit(sim, [](Simulation& s) { s.set_velocity(7, {1, 0, 0}); });
  CHECK(timeline.edits() == 2);
  REQUIRE(timeline.undo(sim));
  CHECK(sim.hash() == one);
  REQUIRE(timeline.go_to(sim, 20, kOn));
  REQUIRE(timeline.go_to(sim, 10, kOn));
  CHECK(sim.hash() == one);
  REQUIRE(timeline.undo(sim));
  CHECK(sim.hash() == before);
  CHECK_FALSE(timeline.undo(sim));
}

TEST_CASE("another integrator at some step, and back to before it") {
  sim::Registry registry = make_registry();
  Simulation sim(make_cloth(5), registry, {.integrator = "verlet", .dt = 0.001});
  const std::vector<std::uint64_t> verlet = hashes_of(sim, 200);
  sim.reset();
  Timeline timeline(sim);
  REQUIRE(timeline.go_to(sim, 100, kOn));
  timeline.edit(sim, [&](Simulation& s) { s.set_integrator(sim::Method(registry, "rk4")); });
  REQUIRE(timeline.go_to(sim, 200, kOn));
  CHECK(sim.method().name() == "rk4");
  const std::uint64_t end = sim.hash();
  CHECK(end != verlet[200]);
  REQUIRE(timeline.go_to(sim, 99, kOn));
  CHECK(sim.method().name() == "verlet");
  CHECK(sim.hash() == verlet[99]);
  REQUIRE(timeline.go_to(sim, 200, kOn));
  CHECK(sim.hash() == end);
  CHECK_THROWS_AS(timeline.edit(sim, [&](Simulation& s) { s.set_dt(-1); }), sim::Error);
  CHECK(timeline.edits() == 1);
  CHECK(sim.hash() == end);
}

TEST_CASE("snapshots stay within their budget over many steps") {
  constexpr std::size_t kBudget = 200'000;
  sim::Registry registry = make_registry();
  Simulation sim(make_cloth(4), registry, {.dt = 0.001});
  Timeline timeline(sim, kBudget);
  std::vector<std::uint64_t> hashes{sim.hash()};
  for (int i = 0; i < 100'000; ++i) {
    REQUIRE(timeline.step(sim));
    hashes.push_back(sim.hash());
    REQUIRE(timeline.bytes() <= kBudget);
  }
  CHECK(timeline.first() == 0);
  for (const std::int64_t step : {99'999, 99'900, 73'211, 20'000, 64, 1, 0, 100'000}) {
    REQUIRE(timeline.go_to(sim, step, kOn));
    CHECK(sim.hash() == hashes[static_cast<std::size_t>(step)]);
  }

  // Changes at every step: the oldest part goes.
  for (int i = 0; i < 1000; ++i) {
    timeline.edit(sim, [](Simulation& s) { s.set_velocity(9, {0, 0, 0}); });
    REQUIRE(timeline.step(sim));
    REQUIRE(timeline.bytes() <= kBudget);
  }
  CHECK(timeline.first() > 100'000);
  CHECK(timeline.last() == 101'000);
}

TEST_CASE("actions stay within the budget, in one step or over many") {
  constexpr std::size_t kBudget = 400'000;
  using What = sim::Action::What;
  const bool stepping = GENERATE(false, true);
  sim::Registry registry = make_registry();
  Simulation sim(make_cloth(4), registry, {.dt = 0.001});
  Simulation same(make_cloth(4), registry, {.dt = 0.001});
  Timeline timeline(sim, kBudget), whole(same, std::size_t{1} << 30);
  const auto act = [&](const sim::Action& action) {
    timeline.act(sim, action);
    whole.act(same, action);
  };
  const auto step = [&] {
    REQUIRE(timeline.step(sim));
    REQUIRE(whole.step(same));
  };
  act({.what = What::kGrab, .particle = 15});
  act({.what = What::kMove, .particle = 15, .x = {0.5, -0.5, 0.5}, .steps = 100'000});
  for (int i = 0; i < 20'000; ++i) {
    timeline.part(sim);
    whole.part(same);
    act({.what = i % 2 == 0 ? What::kPin : What::kUnpin, .particle = 9});
    if (stepping && i % 10 == 0) step();
    REQUIRE(timeline.bytes() <= kBudget);
  }
  CHECK(timeline.actions() == 20'002);
  CHECK(timeline.edits() == whole.edits());
  for (int i = 0; i < 200; ++i) step();
  CHECK((timeline.first() > 0) == stepping);

  // The move that began before all that is left goes on, and each step comes again.
  const std::int64_t last = timeline.last();
  for (const std::int64_t to : {timeline.first(), last - 150, timeline.first() + 10, last}) {
    REQUIRE(timeline.go_to(sim, to, kOn));
    REQUIRE(whole.go_to(same, to, kOn));
    CHECK(sim.hash() == same.hash());
    CHECK(sim.settings().held == std::vector<int>{15});
  }
  int undone = 0;
  while (timeline.undo(sim)) {
    ++undone;
    if (undone > 500) continue;
    REQUIRE(whole.undo(same));
    REQUIRE(sim.hash() == same.hash());
  }
  CHECK(undone > 200);
  CHECK(timeline.actions() == 20'002 - static_cast<std::size_t>(undone));
}

TEST_CASE("drift does not count what changes by hand put in") {
  sim::Registry registry = make_registry();
  Simulation sim(make_cloth(4, {.drag = 0}), registry, {.dt = 1e-4});
  Timeline timeline(sim);
  REQUIRE(timeline.go_to(sim, 100, kOn));
  timeline.edit(sim, [](Simulation& s) { s.set_velocity(9, {100, 0, 0}); });
  const double drift = sim.energy().total() - timeline.start_energy(sim);
  CHECK(std::abs(drift) < 1e-9);
  CHECK(sim.energy().total() > 100);
  REQUIRE(timeline.go_to(sim, 50, kOn));
  CHECK(timeline.start_energy(sim) == 0);
}

TEST_CASE("pinned particles stay, unpinned ones go; masses come back") {
  sim::Registry registry = make_registry();
  sim::SystemSpec chain = make_chain({{0, 0, 0}, {0.25, 0, 0}, {0.5, 0, 0}}, {0}, 0.1);
  chain.particles->list[2].mass = 3;
  Simulation sim(chain, registry, {.integrator = "rk4", .dt = 0.01});
  sim.set_pinned(0, false);
  sim.set_pinned(2, true);
  CHECK(sim.pinned_count() == 1);
  REQUIRE(run(sim, 50));
  CHECK(sim.position(2) == sim::Vec3(0.5, 0, 0));
  CHECK(sim.velocity(2) == sim::Vec3(0, 0, 0));
  CHECK(sim.position(0).y() < -0.1);
  CHECK_THROWS_AS(sim.set_velocity(2, {1, 0, 0}), sim::Error);
  CHECK_THROWS_AS(sim.set_pinned(3, true), sim::Error);

  // The same as a scene that says so from the start.
  chain.particles->pinned = {2};
  Simulation other(chain, registry, {.integrator = "rk4", .dt = 0.01});
  REQUIRE(run(other, 50));
  CHECK(other.hash() == sim.hash());
}

TEST_CASE("the shares of the force on a particle add up to its acceleration") {
  sim::Registry registry = make_registry();
  Simulation sim(make_cloth(8), registry, {.integrator = "euler", .dt = 1e-7});
  REQUIRE(run(sim, 1));
  Simulation rk4(make_cloth(8), registry, {.integrator = "rk4", .dt = 0.005});
  REQUIRE(run(rk4, 100));
  sim.restore([&] {
    sim::Snapshot snapshot = sim.snapshot();
    snapshot.x = rk4.snapshot().x;
    return snapshot;
  }());
  const sim::Vec3 v = sim.velocity(12);
  sim::Vec3 sum = sim::Vec3::Zero();
  std::vector<std::string> names;
  for (const sim::ForceShare& share : sim.forces_on(12)) {
    sum += share.force;
    names.push_back(share.name);
  }
  CHECK(names == std::vector<std::string>{"gravity", "drag", "structural", "shear", "flex"});
  REQUIRE(sim.step());
  const sim::Vec3 a = (sim.velocity(12) - v) / 1e-7;
  CHECK((a / 64 - sum).norm() < 1e-6 * sum.norm());
  CHECK(sim.forces_on(0).size() == 5);  // a pinned one feels them too
}

TEST_CASE("differences say where, in units in the last place") {
  sim::Registry registry = make_registry();
  Simulation a(make_cloth(4), registry), b(make_cloth(4), registry);
  CHECK_FALSE(sim::first_difference(a, b));
  const double x = a.position(5).x();
  b.set_position(5, {std::nextafter(x, 1), a.position(5).y(), a.position(5).z() + 1});
  b.set_velocity(9, {0, 2, 0});
  const auto first = sim::first_difference(a, b);
  REQUIRE(first);
  CHECK(first->id == 5);
  CHECK(first->quantity == "x");
  CHECK(first->ulps() == 1);
  const auto largest = sim::largest_difference(a, b);
  REQUIRE(largest);
  CHECK(largest->id == 9);
  CHECK(largest->quantity == "vy");
  CHECK(largest->relative() == 1);
  CHECK(sim::Difference{0, "particle", "x", -0.0, 0.0}.ulps() == 0);
  CHECK(sim::Difference{0, "particle", "x", -5e-324, 5e-324}.ulps() == 2);
}
