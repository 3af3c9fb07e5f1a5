// Surfaces whose particles constraints join: no crossings after any step, all constraints obeyed.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "core/particles/constraints/constraint_system.h"
#include "tests/support/sheets.h"

using namespace sim_test;
using sim::Vec3;

namespace {

// The structural springs of the sheets become rods.
sim::SystemSpec with_rods(sim::SystemSpec spec) {
  sim::PartSpec rods = make_part("distance", {});
  rods.elements = sim::Elements{.arity = 2};
  const sim::Elements& structural = spec.forces[0].elements;
  for (std::size_t e = 0; e + 1 < structural.ids.size(); e += 2)
    rods.elements.add({structural.ids[e], structural.ids[e + 1]});
  spec.constraints.push_back(rods);
  spec.forces.erase(spec.forces.begin());
  return spec;
}

struct Outcome {
  std::int64_t crossings = 0, acted = 0, shortened = 0;
  double drift = 0, momentum_change = 0;
  std::string refusal;
};

Outcome run(const sim::SystemSpec& spec, int steps, bool compare = true) {
  sim::Registry registry = make_registry();
  sim::Simulation system(spec, registry);
  WithoutContact free(spec, registry);
  Outcome outcome;
  for (int n = 0; n < steps; ++n) {
    if (compare && !free.step_from(system)) {
      outcome.refusal = free.system().divergence().why;
      break;
    }
    if (!system.step()) {
      outcome.refusal = system.divergence().why;
      break;
    }
    if (compare)
      outcome.momentum_change = std::max(outcome.momentum_change, free.momentum_change(system));
    const sim::ConstraintDrift drift =
        system.constraint_system()->drift(system.t(), system.state().data());
    outcome.drift = std::max({outcome.drift, drift.position, drift.velocity});
    outcome.crossings += crossings(system, spec);
  }
  outcome.acted = static_cast<std::int64_t>(figure_of(system, "steps"));
  outcome.shortened = static_cast<std::int64_t>(figure_of(system, "shortened"));
  check_words_of_contact(system);
  return outcome;
}

void report(const std::string& what, const Outcome& o) {
  if (getenv("CRUMPLES"))
    printf("%s: crossings %ld acted %ld shortened %ld drift %.1e momentum %.1e %s\n", what.c_str(),
           long(o.crossings), long(o.acted), long(o.shortened), o.drift, o.momentum_change,
           o.refusal.c_str());
}

}  // namespace

TEST_CASE("a crumpled sheet of rods never crosses itself and obeys them") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const double dt : {0.001, 0.005, 0.01, 0.02})
    for (int trial = 0; trial < 2; ++trial) {
      double a[4];
      for (double& number : a) number = uniform(random);
      sim::SystemSpec spec =
          with_rods(make_sheets(1, {.n = 10, .stiffness = 1}, [&](int, double u, double v) {
            return Vec3(u - 0.5, 0, v - 0.5);
          }));
      // Rods that turn too far in a step are beyond the method itself.
      const double speed = trial == 0 ? 2 : std::min(4.0, 0.01 / dt + 0.8);
      for (auto& particle : spec.particles->list) {
        const Vec3 x = particle.position;
        particle.velocity =
            -speed * x + 0.2 * speed * Vec3(uniform(random), 0, 0) +
            speed * Vec3(0, a[2] * std::sin(9 * x.x()) + a[3] * std::sin(7 * x.z()), 0);
      }
      spec.forces.push_back(make_drag(0.1 / 100));
      spec.dt = dt;
      INFO("dt " << dt << " speed " << speed);
      const Outcome outcome = run(spec, std::min(300, static_cast<int>(1.2 / dt)));
      report("crumple dt " + std::to_string(dt) + " speed " + std::to_string(speed), outcome);
      CHECK(outcome.refusal == "");
      CHECK(outcome.crossings == 0);
      CHECK(outcome.acted > 3);
      CHECK(outcome.shortened == 0);
      CHECK(outcome.drift < 1e-12);
      CHECK(outcome.momentum_change < 1e-12);
    }
}

TEST_CASE("sheets of rods thrown at each other never cross") {
  for (const double speed : {0.5, 5.0, 50.0})
    for (const double dt : {0.001, 0.005, 0.02}) {
      sim::SystemSpec spec =
          with_rods(make_sheets(2, {.n = 8, .stiffness = 0.3}, [](int sheet, double u, double v) {
            const Vec3 at(u - 0.5, 0.1 * sheet + (sheet == 0 ? 0.0 : 0.02), v - 0.5);
            return sheet == 0
                       ? at
                       : Vec3(0.866 * at.x() - 0.5 * at.z(), at.y(), 0.5 * at.x() + 0.866 * at.z());
          }));
      const std::size_t half = spec.particles->list.size() / 2;
      for (std::size_t i = half; i < 2 * half; ++i)
        spec.particles->list[i].velocity = {0.1 * speed, -speed, 0};
      spec.dt = dt;
      INFO("speed " << speed << " dt " << dt);
      const Outcome outcome = run(spec, 60);
      report("thrown dt " + std::to_string(dt) + " speed " + std::to_string(speed), outcome);
      CHECK(outcome.crossings == 0);
      CHECK(outcome.drift < 1e-11 * std::max(1.0, speed));
      CHECK(outcome.momentum_change < 1e-12 * std::max(1.0, speed));
      if (speed * dt < 0.06) CHECK(outcome.refusal == "");
    }
}

TEST_CASE("a cloth that hangs by rods falls over itself and a floor") {
  for (const double dt : {0.001, 0.004}) {
    const int n = 10;
    sim::SystemSpec spec = make_sheets(1, {.n = n, .stiffness = 20}, [](int, double u, double v) {
      return Vec3(u - 0.5, 0.3, v - 0.5 + 0.02 * std::sin(9 * u));
    });
    sim::PartSpec rods = make_part("distance", {});
    rods.elements = sim::Elements{.arity = 2};
    for (const int corner : {0, n * n - 1}) {  // whose pins are nearer to each other
      const Vec3 at = spec.particles->list[static_cast<std::size_t>(corner)].position;
      int before = corner;
      for (int link = 1; link <= 3; ++link) {
        const int id = static_cast<int>(spec.particles->list.size());
        spec.particles->list.push_back(
            {.position = at + link * Vec3(-0.25 * at.x(), 0.08, -0.25 * at.z()), .mass = 0.01});
        rods.elements.add({before, id});
        before = id;
      }
      spec.particles->pinned.push_back(before);
    }
    for (int i = 0; i < n * n; ++i) {
      sim::ParticleSpec& particle = spec.particles->list[static_cast<std::size_t>(i)];
      particle.velocity = {-2 * particle.position.x(), std::sin(9.0 * i),
                           -2 * particle.position.z()};
    }
    // The surface is one of more particles now.
    std::vector<sim::TriangleMesh::Triangle> triangles = sim::grid_triangles({n, n, 1}, false);
    spec.contact->surfaces = {std::make_shared<const sim::TriangleMesh>(
        static_cast<int>(spec.particles->list.size()), std::move(triangles))};
    spec.surfaces = spec.contact->surfaces;
    spec.constraints.push_back(rods);
    spec.forces.push_back(make_gravity());
    spec.forces.push_back(make_drag(0.5 / (n * n)));
    spec.colliders = {make_part("plane", {{"point", Vec3(0, -0.2, 0)}, {"friction", 0.3}})};
    spec.dt = dt;
    INFO("dt " << dt);
    const Outcome outcome = run(spec, static_cast<int>(1 / dt), false);
    report("hung dt " + std::to_string(dt), outcome);
    CHECK(outcome.refusal == "");
    CHECK(outcome.crossings == 0);
    CHECK(outcome.acted > 3);
    CHECK(outcome.drift < 1e-12);
  }
}

TEST_CASE("what rods lead through a surface that has no room is refused") {
  // A sheet of rods is pulled by a corner, which is led, through one that is pinned everywhere.
  const int n = 6;
  sim::SystemSpec spec =
      with_rods(make_sheets(2, {.n = n, .stiffness = 1}, [](int sheet, double u, double v) {
        return Vec3(u - 0.4 + 0.03 * sheet, 0.1 * sheet, v - 0.4 + 0.02 * sheet);
      }));
  for (int i = 0; i < n * n; ++i) spec.particles->pinned.push_back(i);
  const int kinematic = n * n + n * (n / 2) + n / 2;
  spec.particles->pinned.push_back(kinematic);
  spec.particles->list[static_cast<std::size_t>(kinematic)].velocity = {};
  spec.dt = 0.005;
  sim::Registry registry = make_registry();
  sim::Simulation system(spec, registry);
  system.set_held(kinematic, true);
  system.set_velocity(kinematic, {0, -1, 0});
  int steps = 0;
  while (steps < 200 && system.step()) {
    ++steps;
    REQUIRE(crossings(system, spec) == 0);
  }
  CHECK(steps > 5);
  CHECK(steps < 200);
  CHECK_THAT(system.divergence().why, Catch::Contains("no room left"));
  CHECK(figure_of(system, "shortened") > 0);
  check_words_of_contact(system);
}
