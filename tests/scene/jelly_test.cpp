// A block of 3 x 3 x 3 particles, 0.1 m apart, 10 g each, with springs along the edges (100 N/m),
// across the faces (50 N/m) and through the bodies (25 N/m) of its cells, let go from the lattice
// with its top layer held. The expected motion was computed apart from this program, by an
// extrapolation method of high order and by an 8th order Runge-Kutta method that agree to 1e-12 m.
#include <catch2/catch.hpp>

#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"
#include "core/study/limits/spectrum.h"
#include "core/study/problem.h"
#include "tests/support/reference_model.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

sim::PartSpec springs(int n, double spacing, double stiffness,
                      const std::vector<std::array<int, 3>>& steps) {
  sim::PartSpec part = make_springs("springs", stiffness);
  for (const auto& step : steps) {
    double square = 0;
    for (const int s : step) square += s * s;
    part.elements.grids.push_back(
        {.size = {n, n, n}, .step = step, .length = std::sqrt(square) * spacing});
  }
  return part;
}

sim::SystemSpec make_jelly(int n, bool hung) {
  const double a = 0.1;
  sim::SystemSpec spec;
  spec.name = "jelly";
  spec.integrator = "rk4";
  spec.dt = 0.001;
  spec.particles.emplace();
  spec.particles->grid = sim::GridSpec{.size = {n, n, n},
                                       .du = {a, 0, 0},
                                       .dv = {0, a, 0},
                                       .dw = {0, 0, a},
                                       .mass = 0.01,
                                       .directions = 3};
  if (hung)
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) spec.particles->pinned.push_back((i * n + n - 1) * n + k);
  spec.forces = {
      springs(n, a, 100, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}),
      springs(n, a, 50, {{1, 1, 0}, {1, -1, 0}, {1, 0, 1}, {1, 0, -1}, {0, 1, 1}, {0, 1, -1}}),
      springs(n, a, 25, {{1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {1, -1, -1}})};
  if (hung) spec.forces.push_back(make_gravity());
  return spec;
}

}  // namespace

TEST_CASE("a jelly has its springs, all of them in runs") {
  sim::Registry registry = make_registry();
  for (const int n : {3, 9}) {
    sim::Simulation jelly(make_jelly(n, false), registry);
    const long m = n - 1;
    REQUIRE(jelly.families().size() == 1);
    CHECK(jelly.families()[0].second == 3 * n * n * m + 6 * n * m * m + 4 * m * m * m);
    const sim::ParticleSystem& particles = *sim::study::particles_of(jelly);
    CHECK(particles.nets().empty());
    CHECK(particles.runs().size() == 13);  // one an offset
  }
}

TEST_CASE("a hung jelly sags and swings as computed elsewhere") {
  sim::Registry registry = make_registry();
  sim::Simulation jelly(make_jelly(3, true), registry,
                        {.integrator = {"dop853", {{"tol", 1e-12}}}, .dt = 0.05});
  REQUIRE(run(jelly, 1));
  const auto near = [](const sim::Vec3& x, const sim::Vec3& expected, double tolerance) {
    CHECK((x - expected).cwiseAbs().maxCoeff() <= tolerance);
  };
  near(jelly.position(0), {0.0004097212156850565, -0.003215070238497794, 0.000409721215683056},
       1e-9);
  near(jelly.position(1), {0.000216418213703131, -0.0029471655485542856, 0.1}, 1e-9);
  near(jelly.position(10), {0.1, -0.002856830902661857, 0.1}, 1e-9);
  near(jelly.velocity(0), {-0.01736162830852844, 0.09327846079415911, -0.01736162830864236}, 1e-7);
  CHECK(jelly.energy().kinetic == Approx(0.000647320870765565).epsilon(1e-7));
  CHECK(jelly.energy().potential == Approx(0.08764267912923433).epsilon(1e-7));
}

TEST_CASE("the forces of a deformed jelly are those of its springs one by one") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_jelly(5, false);
  std::vector<sim::ParticleSpec> list;
  for (int i = 0; i < spec.particles->count(); ++i) {
    list.push_back(spec.particles->at(i));
    for (int axis = 0; axis < 3; ++axis)
      list.back().position[axis] += 0.02 * std::sin(1.0 + 3 * i + 5 * axis);
  }
  spec.particles->grid.reset();
  spec.particles->list = list;
  sim::Simulation jelly(spec, registry, {.dt = 1e-3});
  ReferenceModel plain(spec);
  for (int i = 0; i < 20; ++i) {
    REQUIRE(jelly.step());
    plain.step("rk4", 1e-3);
  }
  const std::vector<double> expected = plain.state(), found = state_of(jelly);
  for (std::size_t i = 0; i < found.size(); ++i) CHECK(std::abs(found[i] - expected[i]) <= 1e-12);
}

TEST_CASE("the fastest vibration of a free jelly") {
  sim::Registry registry = make_registry();
  sim::Simulation jelly(make_jelly(3, false), registry);
  const auto found = sim::study::spectrum(jelly);
  CHECK(found.fastest.omega == Approx(247.26187166080027).epsilon(1e-6));
}
