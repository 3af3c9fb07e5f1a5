// Fluids against hydrostatics, linear waves, an experiment, and their own books.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/particles/particle_system.h"
#include "core/study/energy_balance.h"
#include "plugins/forces/fluid/fluid_forces.h"
#include "tests/support/tank.h"

using namespace sim_test;
using sim::Vec3;

namespace {

constexpr double kPi = 3.14159265358979323846;

void run_to(sim::Simulation& water, double t) {
  while (water.t() < t) REQUIRE(water.step());
}

double front(const sim::Simulation& water) {
  double x = 0;
  for (int i = 0; i < water.particles(); ++i) x = std::max(x, water.position(i)[0]);
  return x;
}

}  // namespace

TEST_CASE("the pressure of standing water is that of its depth", "[scene][fluid]") {
  sim::Registry registry = make_registry();
  const Tank tank{.nx = 10, .ny = 30, .alpha = 0.4, .sound = 35};
  sim::SystemSpec spec = make_tank(tank, registry);
  spec.forces.push_back(make_drag(0.4 * 5));  // comes to rest within a second
  sim::Simulation water(spec, registry);
  run_to(water, 2);

  sim::FluidForces fluid({1000, 0, tank.sound, 0, 0}, 2, {});
  fluid.add_wall(std::get<sim::Colliders>(spec.forces[1].given.at("boundary"))[0]->make());
  const auto& system = dynamic_cast<sim::ParticleSystem&>(water.ode());
  const sim::ParticleView view = system.view(water.t(), water.state().data());
  fluid.bind(view);
  const double deepest = 1000 * 9.81 * 0.6;
  // In the mean over the kernel, as a gauge reads it: layers of particles that were never stirred
  // have a little more and a little less by turns.
  double worst = 0, density = 0;
  for (int i = 0; i < water.particles(); ++i) {
    const Vec3 x = water.position(i);
    density = std::max(density, fluid.density(i));
    if (0.6 - x[1] < 0.08) continue;  // where the kernel reaches out of the water
    double sum = 0, weights = 0;
    for (int j = 0; j < water.particles(); ++j) {
      const double u = 1 - (water.position(j) - x).norm() / 0.06;
      if (u <= 0) continue;
      weights += u * u;
      sum += u * u *
             (sim::fluid_pressure(fluid.law(), fluid.density(j)) +
              1000 * 9.81 * (water.position(j)[1] - x[1]));
    }
    worst = std::max(worst, std::fabs(sum / weights - 1000 * 9.81 * (0.6 - x[1])) / deepest);
  }
  INFO("worst " << worst << ", densest " << density);
  CHECK(worst < 0.03);
  CHECK(density < 1.01);
  CHECK(density > 1.003);
}

TEST_CASE("water sloshes with the frequency of linear waves", "[scene][fluid]") {
  // omega^2 = g k tanh(k H), k = pi/L: from the flow of a standing wave as it passes its middle.
  sim::Registry registry = make_registry();
  const double length = 0.5, depth = 0.25, k = kPi / length;
  sim::SystemSpec spec = make_tank({.nx = 40,
                                    .ny = 20,
                                    .spacing = 0.0125,
                                    .length = length,
                                    .alpha = 0.02,
                                    .sound = 22,
                                    .solver = GENERATE("wcsph", "dfsph")},
                                   registry);
  for (sim::ParticleSpec& p : spec.particles->list)
    p.velocity = 0.3 / std::cosh(k * depth) *
                 Vec3(std::sin(k * p.position[0]) * std::cosh(k * p.position[1]),
                      -std::cos(k * p.position[0]) * std::sinh(k * p.position[1]), 0);
  sim::Simulation water(spec, registry);
  // The middle of the water crosses that of the tank twice a period.
  const auto middle = [&] {
    double sum = 0;
    for (int i = 0; i < water.particles(); ++i) sum += water.position(i)[0];
    return sum / water.particles() - 0.5 * length;
  };
  std::vector<double> crossings;
  double before = 0, t = 0;
  while (crossings.size() < 4 && water.t() < 3) {
    REQUIRE(water.step());
    const double now = middle();
    if (water.t() > 0.05 && before * now < 0)
      crossings.push_back(t + water.h() * before / (before - now));
    before = now;
    t = water.t();
  }
  REQUIRE(crossings.size() == 4);
  const double omega = kPi / (crossings[3] / 4);
  const double expected = std::sqrt(9.81 * k * std::tanh(k * depth));
  INFO(omega << " rad/s, linear waves " << expected);
  CHECK(omega == Approx(expected).epsilon(0.03));
}

TEST_CASE("a dam breaks as Martin and Moyce saw it", "[scene][fluid]") {
  // The front Z = x/a against T = t sqrt(2 g/a), a = 2.25 inches, a column twice as high: Martin &
  // Moyce (1952), Phil. Trans. R. Soc. A 244, 312-324, points of their figure 3.
  constexpr double kSeen[][2] = {
      {0.832, 1.217}, {1.219, 1.474}, {1.997, 2.292}, {2.547, 2.995}, {3.345, 4.134}};
  sim::Registry registry = make_registry();
  const double a = 0.05715;
  const std::string solver = GENERATE("wcsph", "dfsph");
  sim::SystemSpec spec = make_tank({.nx = 20,
                                    .ny = 40,
                                    .spacing = a / 20,
                                    .length = 0.5,
                                    .alpha = 0.02,
                                    .sound = 15,
                                    .solver = solver},
                                   registry);
  sim::Simulation water(spec, registry);
  // Water that slides on the floor without friction runs ahead of theirs, but not much faster.
  double z[5];
  for (std::size_t k = 0; k < 5; ++k) {
    const auto [time, seen] = kSeen[k];
    run_to(water, time / std::sqrt(2 * 9.81 / a));
    z[k] = front(water) / a;
    INFO("T = " << time << ": " << z[k] << ", seen " << seen);
    CHECK(z[k] > seen);
    CHECK(z[k] < (solver == "wcsph" ? 1.15 : 1.17) * seen);
  }
  const double speed = (z[4] - z[2]) / (kSeen[4][0] - kSeen[2][0]);
  CHECK(speed == Approx((kSeen[4][1] - kSeen[2][1]) / (kSeen[4][0] - kSeen[2][0])).epsilon(0.1));
}

TEST_CASE("water in a room stays there, keeps its books, and is what it was", "[scene][fluid]") {
  sim::Registry registry = make_registry();
  const Tank tank{.nx = 5,
                  .ny = 8,
                  .nz = 4,
                  .spacing = 0.04,
                  .length = 0.6,
                  .sound = 20,
                  .solver = GENERATE("wcsph", "dfsph")};
  const sim::SystemSpec spec = make_tank(tank, registry);
  sim::Simulation water(spec, registry);
  sim::study::EnergyBalance balance(water);
  double outside = 0;
  while (water.t() < 10) {
    REQUIRE(water.step());
    balance.advance();
    if (water.step_count() % 50 != 0) continue;
    balance.look();
    for (int i = 0; i < water.particles(); ++i) {
      const Vec3 x = water.position(i);
      outside = std::max({outside, -x[0], x[0] - 0.6, -x[1], -x[2], x[2] - 0.16});
    }
  }
  CHECK(outside < 1e-9);
  INFO("balance " << balance.error() << " J of " << balance.in_play());
  CHECK(std::fabs(balance.error()) < 0.01 * balance.in_play());
  CHECK(balance.taken() > 0.5 * balance.in_play());
}

TEST_CASE("free water keeps momentum, and its energy under verlet", "[scene][fluid]") {
  sim::Registry registry = make_registry();
  Tank tank{.nx = 8,
            .ny = 8,
            .nz = 8,
            .spacing = 0.02,
            .length = 10,
            .alpha = 0,
            .solver = GENERATE("wcsph", "dfsph")};
  sim::SystemSpec spec = make_tank(tank, registry);
  spec.colliders.clear();
  spec.forces.erase(spec.forces.begin());
  spec.forces[0].given.erase("boundary");
  spec.dt *= 0.5;
  for (const double alpha : {0.0, 0.1}) {
    spec.forces[0].given["alpha"] = alpha;
    spec.forces[0].given["viscosity"] = 0.0;
    int i = 0;
    for (sim::ParticleSpec& p : spec.particles->list) {  // it closes in on its middle, and turns
      const Vec3 d = p.position - Vec3(0.08, 0.08, 0.08);
      p.velocity = -5 * d + Vec3(4 * d[1], -4 * d[0], 0.3 * std::sin(0.1 * i++));
    }
    sim::Simulation water(spec, registry);
    sim::study::EnergyBalance balance(water);
    Vec3 momentum, turning, first, first_turning;
    double size = 0;
    const auto sum = [&] {
      momentum = turning = Vec3();
      size = 0;
      for (int k = 0; k < water.particles(); ++k) {
        momentum += water.velocity(k);
        turning += water.position(k).cross(water.velocity(k));
        size += water.velocity(k).norm();
      }
    };
    sum();
    first = momentum;
    first_turning = turning;
    const double start = water.energy().total();
    for (int step = 0; step < 800; ++step) {
      REQUIRE(water.step());
      balance.advance();
      balance.look();
    }
    sum();
    CHECK((momentum - first).norm() < 1e-12 * size);
    // dfsph leads places back without their velocities.
    CHECK((turning - first_turning).norm() < (tank.solver == "wcsph" ? 1e-12 : 2e-4) * size);
    INFO("alpha " << alpha << ": balance " << balance.error() << " of " << balance.in_play());
    CHECK(std::fabs(balance.error()) < 0.003 * balance.in_play());
    if (alpha > 0) CHECK(water.energy().total() < start - 0.05 * balance.in_play());
  }
}

TEST_CASE("a drop swings with the frequency of its surface tension", "[scene][fluid]") {
  // Rayleigh (1879), Proc. R. Soc. 29, 71-97: omega^2 = 8 sigma/(rho R^3) between flat and long.
  sim::Registry registry = make_registry();
  const int across = 6;
  const double radius = 0.01, a = radius / across, sigma = 0.0728, sound = 1.5;
  sim::SystemSpec spec = make_falling(1, 0);
  spec.forces = {make_part(
      "fluid",
      {{"speed_of_sound", sound}, {"viscosity", 0.0}, {"alpha", 1.0}, {"surface_tension", sigma}})};
  spec.integrator.name = "verlet";
  spec.dt = 0.4 * 1.5 * a / sound;
  auto& list = spec.particles->list;
  list.clear();
  int count = 0;
  const auto off = [&] { return 0.2 * (std::fmod(0.618034 * ++count, 1) - 0.5); };
  for (int i = -across; i <= across; ++i)
    for (int j = -across; j <= across; ++j)
      for (int k = -across; k <= across; ++k) {
        const Vec3 x = a * Vec3(i + 0.3 + off(), j + 0.2 + off(), k + 0.4 + off());
        if (x.norm() < radius) list.push_back({x, {0, 0, 0}, 1000 * a * a * a});
      }
  const double size = std::cbrt(static_cast<double>(list.size()) * 0.75 / kPi) * a;
  {  // it becomes round
    sim::Simulation still(spec, registry);
    run_to(still, 0.3);
    Vec3 middle;
    for (int i = 0; i < still.particles(); ++i) middle += still.position(i) / still.particles();
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Vec3 x = still.position(static_cast<int>(i)) - middle;
      list[i].position = x;
      list[i].velocity = 4 * Vec3(x[0], -0.5 * x[1], -0.5 * x[2]);
    }
  }
  spec.forces[0].given["alpha"] = 0.02;
  sim::Simulation drop(spec, registry);
  const auto length = [&] {
    double sum = 0;
    for (int i = 0; i < drop.particles(); ++i) {
      const Vec3 x = drop.position(i);
      sum += x[0] * x[0] - 0.5 * (x[1] * x[1] + x[2] * x[2]);
    }
    return sum;
  };
  std::vector<double> turns;
  for (double before = 0, last = length(); turns.size() < 5 && drop.t() < 1.5;) {
    REQUIRE(drop.step());
    const double now = length();
    if ((last - before) * (now - last) < 0 && drop.t() > (turns.empty() ? 0 : turns.back()) + 0.04)
      turns.push_back(drop.t());
    before = last;
    last = now;
  }
  REQUIRE(turns.size() == 5);
  const double omega = 4 * kPi / (turns[4] - turns[0]);
  CHECK(omega == Approx(std::sqrt(8 * sigma / (1000 * size * size * size))).epsilon(0.06));
}

namespace {

// Water and a sheet of n x n particles in its middle, somewhat out of order, nothing held.
sim::SystemSpec water_with_sheet(int n, double a) {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list.clear();
  spec.forces.clear();
  double told = 0;
  const auto off = [&] { return 0.1 * a * std::fmod(told += 0.618034, 1); };
  std::vector<int> water;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        if (k == n / 2) continue;
        water.push_back(static_cast<int>(spec.particles->list.size()));
        spec.particles->list.push_back({a * Vec3(i, j, 0.9 * k) + Vec3(off(), off(), off()),
                                        Vec3(off(), 0, k < n / 2 ? 1 : -1), 1000 * a * a * a});
      }
  const int first = static_cast<int>(spec.particles->list.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      spec.particles->list.push_back({a * Vec3(i, j, 0.9 * (n / 2)) + Vec3(off(), off(), off()),
                                      Vec3(0, 0, 0), 400 * a * a * a});
  std::vector<sim::TriangleMesh::Triangle> triangles = sim::grid_triangles({n, n, 1}, false);
  for (auto& triangle : triangles)
    for (int& id : triangle) id += first;
  const auto sheet = std::make_shared<const sim::TriangleMesh>(first + n * n, std::move(triangles));
  spec.surfaces = {sheet};
  sim::PartSpec fluid = make_part(
      "fluid", {{"speed_of_sound", 20.0}, {"alpha", 0.0}, {"viscosity", 0.0}, {"solid", sheet}});
  fluid.elements = sim::Elements{.arity = 1};
  for (const int id : water) fluid.elements.add({id});
  spec.forces.push_back(fluid);
  spec.dt = 0.2 * 1.5 * a / 20;
  return spec;
}

}  // namespace

TEST_CASE("a fluid and a solid push each other: momentum, energy, and none passes") {
  const int n = 8;
  const double a = 0.05;
  const sim::SystemSpec spec = water_with_sheet(n, a);
  sim::Registry registry = make_registry();
  sim::Simulation system(spec, registry);
  const auto momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < system.particles(); ++i)
      sum += spec.particles->at(i).mass * system.velocity(i);
    return sum;
  };
  const Vec3 before = momentum();
  const double energy = system.energy().total();
  double pushed = 0;
  for (int step = 0; step < 100; ++step) {
    REQUIRE(system.step());
    for (int i = n * n * (n - 1); i < system.particles(); ++i)
      pushed = std::max(pushed, system.velocity(i).norm());
  }
  CHECK(pushed > 0.05);
  CHECK((momentum() - before).norm() < 1e-12);
  CHECK(std::fabs(system.energy().total() - energy) < 2e-3 * energy);
  // The same bits on threads, and from a snapshot into lists with another past.
  sim::Simulation two(spec, registry, {.threads = 2}), again(spec, registry);
  for (int step = 0; step < 50; ++step) REQUIRE(two.step());
  again.restore(two.snapshot());
  for (int step = 0; step < 50; ++step) REQUIRE((two.step() && again.step()));
  CHECK(two.hash() == system.hash());
  CHECK(again.hash() == system.hash());
}

TEST_CASE("a solid too wide for the fluid, or made of it, is refused by name") {
  sim::Registry registry = make_registry();
  sim::SystemSpec wide = water_with_sheet(4, 0.05);
  for (std::size_t i = 48; i < 64; ++i)
    wide.particles->list[i].position = 4 * wide.particles->list[i].position;
  CHECK_THROWS_WITH(sim::Simulation(wide, registry), Catch::Contains("they would pass through"));
  sim::SystemSpec both = water_with_sheet(4, 0.05);
  both.forces[0].elements.add({50});
  CHECK_THROWS_WITH(sim::Simulation(both, registry),
                    Catch::Contains("particle 50 is of the fluid and of its solid"));
}
