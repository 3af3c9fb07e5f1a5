// Density constraints of a fluid: rows against differences, pressures against their equations.
#include "plugins/forces/fluid/fluid_projection.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/particles/particle_system.h"
#include "core/particles/step_correction.h"
#include "core/study/energy_balance.h"
#include "plugins/forces/fluid/fluid_forces.h"
#include "tests/support/tank.h"

using namespace sim;
using sim_test::make_tank;

namespace {

double dice(int i) {
  return 2 * std::fmod(std::fabs(std::sin(12.9898 * i + 4.1) * 43758.5453), 1) - 1;
}

// A plane that moves along its normal.
class Piston final : public Collider {
 public:
  Piston(const Vec3& normal, double place, double speed)
      : normal_(normal), place_(place), speed_(speed) {}

  ContactMaterial material() const override { return {}; }
  SurfaceSample query(double t, const Vec3& x) const override {
    return {normal_.dot(x) - place_ - speed_ * t, normal_, speed_ * normal_};
  }

 private:
  Vec3 normal_;
  double place_, speed_;
};

// A lump of fluid, shaken, a little too dense, in the corner of two walls of which one moves.
struct Lump {
  explicit Lump(int size, double spacing = 0.95) : n(size * size * size) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      q[axis].assign(static_cast<std::size_t>(n + 16), 0);
      v[axis].assign(static_cast<std::size_t>(n + 16), 0);
    }
    for (int i = 0; i < n; ++i) {
      const int cell[3] = {i % size, i / size % size, i / size / size};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int number = 3 * i + static_cast<int>(axis);
        q[axis][static_cast<std::size_t>(i)] = spacing * (cell[axis] + 0.4) + 0.1 * dice(number);
        v[axis][static_cast<std::size_t>(i)] = dice(number + 7000);
      }
    }
    mass.assign(static_cast<std::size_t>(n), 1);
    view.n = n;
    view.x = q[0].data(), view.y = q[1].data(), view.z = q[2].data();
    view.vx = v[0].data(), view.vy = v[1].data(), view.vz = v[2].data();
    view.mass = mass.data();
    law = {.dimensions = 3, .volume = 1, .smoothing = 1.5};
    fit_to_lattice(law);
    law.viscosity = 0.3;
  }
  Lump(const Lump&) = delete;
  Lump& operator=(const Lump&) = delete;

  DensityConstraints rows() {
    DensityConstraints rows;
    rows.add_wall(std::make_unique<Piston>(Vec3(0, 1, 0), 0, 0));
    rows.add_wall(std::make_unique<Piston>(Vec3(1, 0, 0), 0, 0.7));
    rows.bind(law, view);
    rows.make(view, pool);
    return rows;
  }

  int n;
  std::vector<double> q[3], v[3], mass;
  ParticleView view;
  FluidLaw law;
  ThreadPool pool{1};
};

// The density of each id.
std::vector<double> densities(const DensityConstraints& rows, int n) {
  std::vector<double> list;
  for (int i = 0; i < n; ++i) list.push_back(rows.densities()[rows.place(i)]);
  return list;
}

// Four numbers a place.
std::vector<double> at_places(const DensityConstraints& rows, const Lump& lump) {
  std::vector<double> list(4 * static_cast<std::size_t>(rows.places()));
  for (int p = 0; p < lump.n; ++p)
    for (std::size_t axis = 0; axis < 3; ++axis)
      list[4 * static_cast<std::size_t>(p) + axis] =
          lump.v[axis][static_cast<std::size_t>(rows.id(p))];
  return list;
}

}  // namespace

TEST_CASE("rows of a fluid are the derivatives of its densities, images and moving walls too") {
  Lump lump(6);
  const DensityConstraints rows = lump.rows();
  const std::vector<double> displacements = at_places(rows, lump);
  std::vector<double> rates(static_cast<std::size_t>(rows.places()));
  rows.rate(displacements.data(), rates.data(), lump.pool);

  // The same densities a moment earlier and later.
  constexpr double kMoment = 1e-5;
  std::vector<double> ends[2];
  for (const int side : {0, 1}) {
    Lump moved(6);
    moved.view.t = side == 0 ? -kMoment : kMoment;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t i = 0; i < static_cast<std::size_t>(lump.n); ++i)
        moved.q[axis][i] += moved.view.t * lump.v[axis][i];
    ends[side] = densities(moved.rows(), lump.n);
  }
  double worst = 0, largest = 0, walls = 0;
  for (int i = 0; i < lump.n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double seen = (ends[1][k] - ends[0][k]) / (2 * kMoment);
    const double wall = rows.wall_rates()[rows.place(i)];
    worst =
        std::max(worst, std::fabs(rates[static_cast<std::size_t>(rows.place(i))] + wall - seen));
    largest = std::max(largest, std::fabs(seen));
    walls = std::max(walls, std::fabs(wall));
  }
  CHECK(worst < 1e-6 * largest);
  CHECK(walls > 0.1 * largest);

  // (J w).p = w.(J' p)
  std::vector<double> p(rates.size()), pressure_forces(displacements.size());
  for (int k = 0; k < lump.n; ++k) p[static_cast<std::size_t>(k)] = dice(k + 90);
  rows.push(p.data(), pressure_forces.data(), lump.pool);
  double one = 0, other = 0;
  for (int k = 0; k < lump.n; ++k)
    one += p[static_cast<std::size_t>(k)] * rates[static_cast<std::size_t>(k)];
  for (std::size_t k = 0; k < displacements.size(); ++k)
    other += displacements[k] * pressure_forces[k];
  CHECK(one == Approx(other).epsilon(1e-12));
}

// Pairs of which two of the three differences are exactly 0, in blocks of eight that are not full.
TEST_CASE("rows of particles in one line along an axis are the derivatives of their densities") {
  for (const std::size_t axis : {0, 1, 2})
    for (int count = 2; count <= 17; ++count) {
      CAPTURE(axis, count);
      constexpr double kMoment = 1e-5;
      std::vector<double> rates, ends[2];
      for (const int side : {-1, 0, 1}) {
        Lump lump(3);
        lump.n = lump.view.n = count;
        lump.view.t = kMoment * side;
        for (std::size_t k = 0; k < 3; ++k)
          for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
            const double number = static_cast<double>(i);
            lump.q[k][i] = k == axis ? 9 + 0.9 * number : 9;
            lump.v[k][i] = k == axis ? std::sin(2 * number) : 0;
            lump.q[k][i] += lump.view.t * lump.v[k][i];
          }
        const DensityConstraints rows = lump.rows();
        if (side != 0) {
          ends[side > 0] = densities(rows, count);
          continue;
        }
        const std::vector<double> way = at_places(rows, lump);
        std::vector<double> at(static_cast<std::size_t>(rows.places()));
        rows.rate(way.data(), at.data(), lump.pool);
        for (int i = 0; i < count; ++i)
          rates.push_back(at[static_cast<std::size_t>(rows.place(i))]);
      }
      for (std::size_t i = 0; i < rates.size(); ++i)
        CHECK(rates[i] == Approx((ends[1][i] - ends[0][i]) / (2 * kMoment)).margin(1e-5));
    }
}

TEST_CASE("rows of a fluid have the densities and the friction of its forces") {
  Lump lump(6);
  const DensityConstraints rows = lump.rows();
  FluidForces fluid({1, 1.5, 10, 0.3, 0, 0}, 3, {});
  fluid.add_wall(std::make_unique<Piston>(Vec3(0, 1, 0), 0, 0));
  fluid.add_wall(std::make_unique<Piston>(Vec3(1, 0, 0), 0, 0.7));
  fluid.bind(lump.view);
  fluid.prepare(lump.view, lump.pool);
  std::vector<double> f[3];
  for (auto& axis : f) axis.assign(static_cast<std::size_t>(lump.n), 0);
  fluid.add_viscosity({0, lump.n}, {f[0].data(), f[1].data(), f[2].data()});
  const std::vector<double> displacements = at_places(rows, lump);
  std::vector<double> viscous_forces(displacements.size());
  rows.apply_viscosity(displacements.data(), viscous_forces.data(), lump.pool);
  double worst = 0, largest = 0;
  for (int i = 0; i < lump.n; ++i) {
    CHECK(rows.densities()[rows.place(i)] == Approx(fluid.density(i)).epsilon(1e-13));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double force = f[axis][static_cast<std::size_t>(i)];
      const auto at = 4 * static_cast<std::size_t>(rows.place(i)) + axis;
      worst = std::max(worst, std::fabs(force + viscous_forces[at]));
      largest = std::max(largest, std::fabs(force));
    }
  }
  CHECK(worst < 1e-6 * largest);
}

TEST_CASE("pressures of a fluid meet their conditions, for particles that are held too") {
  Lump lump(6);
  for (int i = 0; i < lump.n; i += 17) lump.mass[static_cast<std::size_t>(i)] = HUGE_VAL;
  lump.mass[5] = 3;
  const DensityConstraints rows = lump.rows();
  PressureSolve solve;
  solve.bind(lump.n, 5);
  std::vector<double> wanted(static_cast<std::size_t>(rows.places()));
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  for (int p = 0; p < lump.n; ++p)
    wanted[at(p)] = lump.mass[at(rows.id(p))] < HUGE_VAL ? rows.densities()[p] - 1.02 : 0;
  const std::span<double> pressures = solve.pressures(rows);
  for (int p = 0; p < lump.n; p += 3) pressures[at(p)] = 0.01;  // from anywhere
  REQUIRE(solve.solve(rows, wanted.data(), lump.mass.data(), 1e-12, lump.pool));
  std::vector<double> result(wanted.size());
  rows.rate(solve.pressure_forces(), result.data(), lump.pool);
  int pressed = 0;
  for (int p = 0; p < lump.n; ++p) {
    const double missing = wanted[at(p)] + result[at(p)];  // A p is -J of the pushes
    CHECK(pressures[at(p)] >= 0);
    CHECK(missing < 1e-9);
    if (pressures[at(p)] > 0 && std::fabs(missing) > 1e-9) FAIL("a pressure without need");
    pressed += pressures[at(p)] > 0;
    if (!(lump.mass[at(rows.id(p))] < HUGE_VAL))
      for (int axis = 0; axis < 3; ++axis) CHECK(solve.pressure_forces()[4 * p + axis] == 0);
  }
  CHECK(pressed > lump.n / 4);
  CHECK(pressed < lump.n);
}

TEST_CASE("pressures that are not found to the end push all the same, as they are") {
  Lump lump(4);
  lump.q[0][5] = 100;  // nobody can do anything for it
  const DensityConstraints rows = lump.rows();
  PressureSolve solve;
  solve.bind(lump.n, 5);
  const std::vector<double> wanted(static_cast<std::size_t>(rows.places()), 0.1);
  CHECK(!solve.solve(rows, wanted.data(), lump.mass.data(), 1e-3, lump.pool));
  std::vector<double> pressure_forces(4 * static_cast<std::size_t>(rows.places()));
  rows.push(solve.pressures(rows).data(), pressure_forces.data(), lump.pool);
  for (std::size_t k = 0; k < pressure_forces.size(); ++k)
    CHECK(solve.pressure_forces()[k] == -pressure_forces[k]);
}

TEST_CASE("water that keeps its density does so, whatever its threads", "[scene][fluid]") {
  Registry registry = sim_test::make_registry();
  SystemSpec spec = make_tank(
      {.nx = 8, .ny = 10, .nz = 60, .spacing = 0.04, .length = 0.6, .sound = 20, .solver = "dfsph"},
      registry);
  Simulation one(spec, registry, {.threads = {1}}), three(spec, registry, {.threads = {3}});
  REQUIRE(three.threads() > 1);
  for (int step = 0; step < 16; ++step) {
    REQUIRE(one.step());
    REQUIRE(three.step());
  }
  CHECK(one.hash() == three.hash());
  FluidForces fluid({1000, 0, 20, 0, 0}, 3, {});
  fluid.add_wall(std::get<Colliders>(spec.forces[1].given.at("boundary"))[0]->make());
  const auto& system = dynamic_cast<ParticleSystem&>(one.ode());
  fluid.bind(system.view(one.t(), one.state().data()));
  const auto account = one.corrections()[0]->account();
  INFO(account.words);
  CHECK(account.kept);
  double mean = 0, worst = 0;
  for (int i = 0; i < one.particles(); ++i) {
    const double more = std::max(0.0, fluid.density(i) - 1);
    mean += more / one.particles();
    worst = std::max(worst, more);
  }
  INFO("density " << mean << ", of a particle " << worst);
  CHECK(mean < 1.01e-3);
  CHECK(worst < 1.01e-2);
  CHECK(mean > 1e-5);
}

TEST_CASE("pinned water stays where it is, in a wall too", "[scene][fluid]") {
  Registry registry = sim_test::make_registry();
  SystemSpec spec = make_tank({.nx = 5, .ny = 8, .solver = "dfsph"}, registry);
  const Vec3 places[] = {{-0.03, 0.05, 0}, {0.05, -0.01, 0}, {0.15, 0.05, 0}};
  for (const Vec3& place : places) {
    spec.particles->pinned.push_back(static_cast<int>(spec.particles->list.size()));
    spec.particles->list.push_back({place, Vec3::Zero(), spec.particles->list[0].mass});
  }
  Simulation water(spec, registry);
  for (int step = 0; step < 20; ++step) REQUIRE(water.step());
  for (std::size_t k = 0; k < 3; ++k) CHECK(water.position(spec.particles->pinned[k]) == places[k]);
  CHECK(water.velocity(0).norm() > 1e-3);  // the rest moves
}

TEST_CASE("water that keeps its density goes on from a snapshot with the same bits") {
  // It turns slowly: lists are kept for many steps, and those of the other are of another time.
  Registry registry = sim_test::make_registry();
  SystemSpec spec = make_tank({.alpha = 0, .solver = "dfsph"}, registry);
  for (ParticleSpec& p : spec.particles->list)
    p.velocity = 0.5 * Vec3(p.position[1] - 0.2, 0.1 - p.position[0], 0);
  Simulation one(spec, registry), other(spec, registry);
  while (one.t() < 0.1) REQUIRE(one.step());
  for (int part = 0; part < 5; ++part) {
    other.restore(one.snapshot());
    for (int step = 0; step < 7; ++step) {
      REQUIRE(one.step());
      REQUIRE(other.step());
    }
    CHECK(one.hash() == other.hash());
  }
}

TEST_CASE("pressures that keep the density of standing water are those of its depth",
          "[scene][fluid]") {
  Registry registry = sim_test::make_registry();
  SystemSpec spec =
      make_tank({.nx = 10, .ny = 30, .alpha = 0.4, .sound = 35, .solver = "dfsph"}, registry);
  spec.forces.push_back(sim_test::make_drag(0.4 * 5));
  Simulation water(spec, registry);
  while (water.t() < 2) REQUIRE(water.step());
  // In the mean over a tenth of a second, for steps make them tremble, and over each layer.
  std::vector<double> sums(10), counts(10);
  for (int step = 0; step < 60; ++step) {
    REQUIRE(water.step());
    const auto& system = dynamic_cast<ParticleSystem&>(water.ode());
    const ParticleView view = system.view(water.t(), water.state().data());
    for (int i = 0; i < water.particles(); ++i) {
      const auto layer =
          static_cast<std::size_t>(std::clamp(water.position(i)[1] / 0.06, 0.0, 9.0));
      sums[layer] +=
          view.internal[static_cast<std::size_t>(i)] +
          1000 * 9.81 * (water.position(i)[1] - 0.06 * (static_cast<double>(layer) + 0.5));
      ++counts[layer];
    }
  }
  double worst = 0;
  for (std::size_t layer = 0; layer < 8; ++layer)
    worst =
        std::max(worst, std::fabs(sums[layer] / counts[layer] -
                                  1000 * 9.81 * (0.6 - 0.06 * (static_cast<double>(layer) + 0.5))));
  INFO("worst " << worst / (1000 * 9.81 * 0.6));
  CHECK(worst < 0.03 * 1000 * 9.81 * 0.6);
}

TEST_CASE("water that keeps its density is stepped by any method of fixed steps") {
  Registry registry = sim_test::make_registry();
  const std::string method = GENERATE("verlet", "rk4", "implicit_midpoint", "symplectic_euler");
  const SystemSpec spec = make_tank(
      {.nx = 34, .ny = 60, .spacing = 0.01, .length = 0.6, .integrator = method, .solver = "dfsph"},
      registry);
  Simulation water(spec, registry);
  const double start = water.energy().total();
  while (water.t() < 0.2) REQUIRE(water.step());
  // Weight alone is left to the method, and all but symplectic_euler keep its energy.
  const double sum = water.energy().total() + water.contact_work().lost;
  if (method != "symplectic_euler") CHECK(sum == Approx(start).epsilon(1e-10));
  CHECK(water.corrections()[0]->account().kept);
  CHECK(water.contact_work().lost > 0.01 * start);
  water.reset();
  CHECK(water.corrections()[0]->account().words.empty());
}

TEST_CASE("what a fluid that keeps its density does not do is refused by name", "[scene][fluid]") {
  Registry registry = sim_test::make_registry();
  SystemSpec spec = make_tank({.integrator = "dopri5", .solver = "dfsph"}, registry);
  CHECK_THROWS_WITH(Simulation(spec, registry), Catch::Contains("dfsph"));
  spec.integrator.name = "verlet";
  CHECK_NOTHROW(Simulation(spec, registry));
  spec.constraints = {sim_test::make_part("distance", {{"length", 0.02}})};
  spec.constraints[0].elements = {.arity = 2, .ids = {0, 1}};
  CHECK_THROWS_WITH(Simulation(spec, registry), Catch::Contains("particle 0 is of a fluid"));
  spec.constraints.clear();
  spec.forces[1].given["bodies"] = Bodies{};
  CHECK_THROWS_WITH(Simulation(spec, registry), Catch::Contains("dfsph"));
}
