// Large nets whose particles are numbered at random: their steps are made in the order of places.
#include "core/particles/explicit/reordering.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <random>

#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

using sim::Vec3;

constexpr int kSide = 184;  // 33856 particles: enough for an order of their own

// m: 20 steps take roundings of places, 1e-16 m, with k / m of 3e6 1/s^2 and h = 1e-4 s, to 1e-12
// m/s and 1e-15 m; a spring that is missing or wrong shows as 1e-8 m.
constexpr double kRounding = 1e-13;

struct NetOptions {
  bool shuffled = true, masses = false;
  double jitter = 0;  // of places, in distances of the grid
};

// The cloth of make_cloth as a list of particles and ties, and the number of each of its places.
sim::SystemSpec make_net(const NetOptions& options, std::vector<int>& number) {
  sim::SystemSpec spec = make_cloth(kSide);
  const sim::ParticlesSpec cloth = *spec.particles;
  const int n = cloth.count();
  number.resize(static_cast<std::size_t>(n));
  std::iota(number.begin(), number.end(), 0);
  std::mt19937 random(1);
  if (options.shuffled) std::shuffle(number.begin(), number.end(), random);
  std::mt19937 shift(2);
  const double range = options.jitter / kSide;
  std::uniform_real_distribution<double> some(-range, range);
  sim::ParticlesSpec net;
  net.list.resize(static_cast<std::size_t>(n));
  const auto of = [&](int place) { return number[static_cast<std::size_t>(place)]; };
  for (int i = 0; i < n; ++i) {
    sim::ParticleSpec particle = cloth.at(i);
    if (options.jitter > 0) particle.position += Vec3(some(shift), some(shift), some(shift));
    if (options.masses) particle.mass *= 1 + 0.25 * (i % 3);
    particle.velocity = Vec3(0, 0.1 * std::sin(0.3 * i), 0.05 * std::cos(0.1 * i));
    net.list[static_cast<std::size_t>(of(i))] = particle;
  }
  for (const int i : cloth.pinned) net.pinned.push_back(of(i));
  spec.particles = net;
  for (sim::PartSpec& force : spec.forces) {
    if (force.elements.grids.empty()) continue;
    sim::Elements ties;
    const double rest = force.elements.grids.front().length;
    force.elements.for_each([&](const auto& tie) {
      ties.add({of(tie.ids[0]), of(tie.ids[1])}, {{"rest", rest}});
    });
    force.elements = ties;
  }
  return spec;
}

// The numbering as steppers of the system make it.
sim::Reordering numbering_of(sim::Simulation& simulation) {
  const auto& system = dynamic_cast<sim::ParticleSystem&>(simulation.ode());
  return {system, sim::Reordering::rows_of(system.view(0, simulation.state().data()))};
}

// The largest distance of the same places in two runs.
double apart(const sim::Simulation& a, const std::vector<int>& of_a, const sim::Simulation& b,
             const std::vector<int>& of_b) {
  double most = 0;
  for (std::size_t i = 0; i < of_a.size(); ++i)
    most = std::max({most, (a.position(of_a[i]) - b.position(of_b[i])).norm(),
                     1e-2 * (a.velocity(of_a[i]) - b.velocity(of_b[i])).norm()});
  return most;
}

}  // namespace

TEST_CASE("a shuffled cloth steps as the ordered one does, in runs") {
  sim::Registry registry = make_registry();
  for (const bool masses : {false, true}) {
    std::vector<int> ordered_number, number;
    const sim::SystemSpec ordered = make_net({.shuffled = false, .masses = masses}, ordered_number);
    const sim::SystemSpec shuffled = make_net({.masses = masses}, number);
    for (const char* method : {"verlet", "rk4", "symplectic_euler"}) {
      INFO(method);
      const sim::RunOptions options = fixed_steps(method, 1e-4, registry);
      sim::Simulation a(ordered, registry, options), b(shuffled, registry, options);
      const auto& system = dynamic_cast<sim::ParticleSystem&>(b.ode());
      REQUIRE(system.nets().size() == 3);
      CHECK(system.nets().front()->reordered());
      const sim::Reordering numbering = numbering_of(b);
      for (const sim::Springs& springs : numbering.springs()) {
        CHECK(springs.net().empty());
        CHECK(springs.runs().size() == 2);
      }
      for (int p = 0; p < system.layout().n(); ++p)
        REQUIRE(numbering.place()[static_cast<std::size_t>(
                    numbering.order()[static_cast<std::size_t>(p)])] == p);
      CHECK(run(a, 20));
      CHECK(run(b, 20));
      CHECK(apart(a, ordered_number, b, number) < kRounding);
      for (const int pin : shuffled.particles->pinned) {
        const Vec3 start = shuffled.particles->at(pin).position;
        CHECK(b.position(pin) == start);
        CHECK(b.velocity(pin) == Vec3::Zero());
      }
    }
  }
}

TEST_CASE(
    "where places are no grid, neighbours are near all the same, and forces those of the net") {
  sim::Registry registry = make_registry();
  std::vector<int> ordered_number, number;
  const sim::SystemSpec ordered = make_net({.shuffled = false, .jitter = 0.3}, ordered_number);
  const sim::SystemSpec shuffled = make_net({.jitter = 0.3}, number);
  const sim::RunOptions options = fixed_steps("verlet", 1e-4, registry);
  sim::Simulation a(ordered, registry, options), b(shuffled, registry, options);
  const sim::Reordering numbering = numbering_of(b);
  CHECK_FALSE(numbering.springs().front().net().empty());
  CHECK_FALSE(numbering.springs().front().net().reordered());
  CHECK(run(a, 20));
  CHECK(run(b, 20));
  CHECK(apart(a, ordered_number, b, number) < kRounding);
}

TEST_CASE("a shuffled cloth has the same bits on threads, at once, and after a change") {
  sim::Registry registry = make_registry();
  std::vector<int> number;
  const sim::SystemSpec spec = make_net({}, number);
  for (const char* method : {"verlet", "rk4"}) {
    INFO(method);
    sim::RunOptions options = fixed_steps(method, 1e-4, registry);
    sim::Simulation one(spec, registry, options);
    options.threads = 3;
    sim::Simulation three(spec, registry, options);
    for (int k = 0; k < 12; ++k) REQUIRE(one.step());
    for (std::int64_t done = 0; done < 12;) done += three.steps(12 - done);
    CHECK(one.hash() == three.hash());

    // A hand moves one particle, and another is pinned: both runs go on from there.
    for (sim::Simulation* system : {&one, &three}) {
      system->set_velocity(number[5000], {0, 3, 0});
      system->set_pinned(number[7000], true);
    }
    const sim::Snapshot there = one.snapshot();
    REQUIRE(one.step());
    REQUIRE(one.step());
    for (std::int64_t done = 0; done < 2;) done += three.steps(2 - done);
    CHECK(one.hash() == three.hash());
    const std::uint64_t after = one.hash();
    CHECK(one.velocity(number[5000]).y() > 2);
    one.restore(there);
    CHECK(run(one, 2));
    CHECK(one.hash() == after);
  }
}

TEST_CASE("springs that are switched off are off in the other order, too") {
  sim::Registry registry = make_registry();
  std::vector<int> ordered_number, number;
  sim::SystemSpec ordered = make_net({.shuffled = false}, ordered_number);
  sim::SystemSpec shuffled = make_net({}, number);
  const sim::RunOptions options = fixed_steps("verlet", 1e-4, registry);
  for (sim::SystemSpec* spec : {&ordered, &shuffled}) spec->forces.back().switch_name = "last";
  sim::Simulation a(ordered, registry, options), b(shuffled, registry, options);
  const sim::Reordering before = numbering_of(b);
  for (sim::Simulation* system : {&a, &b}) {
    CHECK(run(*system, 2));
    system->set_switch("last", false);
    CHECK(run(*system, 10));
  }
  CHECK(apart(a, ordered_number, b, number) < kRounding);
  const auto& system = dynamic_cast<sim::ParticleSystem&>(b.ode());
  CHECK_FALSE(before.fits(system));
  CHECK(numbering_of(b).fits(system));
  CHECK(numbering_of(b).springs().size() == 2);
}

}  // namespace sim_test
