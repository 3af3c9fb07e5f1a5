// Damped scenes come to rest where statics says, and no force is left there.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/study/rest.h"
#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

std::vector<sim::Vec3> vertical_chain() {
  std::vector<sim::Vec3> points = {{0, 0, 0}};
  const Table table("vertical_chain.csv");
  for (const Row& row : table.rows()) points.emplace_back(0, row.number("y"), 0);
  return points;
}

std::vector<sim::Vec3> points_of(const std::string& file) {
  std::vector<sim::Vec3> points;
  const Table table(file);
  for (const Row& row : table.rows())
    points.emplace_back(row.number("x"), row.number("y"),
                        file == "catenary.csv" ? 0 : row.number("z"));
  return points;
}

// The particles of the scene one by one at other places; the rest lengths stay.
sim::SystemSpec moved_to(sim::SystemSpec spec, const std::vector<sim::Vec3>& points) {
  std::vector<sim::ParticleSpec> list;
  for (int i = 0; i < spec.particles->count(); ++i) list.push_back(spec.particles->at(i));
  REQUIRE(list.size() == points.size());
  for (std::size_t i = 0; i < points.size(); ++i) list[i].position = points[i];
  spec.particles->grid.reset();
  spec.particles->list = list;
  return spec;
}

double largest_distance(const sim::Simulation& simulation, const std::vector<sim::Vec3>& points) {
  double largest = 0;
  for (int i = 0; i < simulation.particles(); ++i)
    largest =
        std::max(largest, (simulation.position(i) - points[static_cast<std::size_t>(i)]).norm());
  return largest;
}

// The largest force in N on a particle of that mass: one Euler step of 1 s from rest.
double largest_force(const sim::SystemSpec& spec, double mass, sim::Registry& registry) {
  sim::Simulation simulation(spec, registry, {.integrator = "euler", .dt = 1});
  REQUIRE(simulation.step());
  double largest = 0;
  for (int i = 0; i < simulation.particles(); ++i)
    largest = std::max(largest, mass * simulation.velocity(i).norm());
  return largest;
}

}  // namespace

TEST_CASE("a hanging chain comes to rest under the weights below each link") {
  sim::Registry registry = make_registry();
  const std::vector<sim::Vec3> rest = vertical_chain();
  std::vector<sim::Vec3> start;
  for (int i = 0; i <= 10; ++i) start.emplace_back(0, -0.25 * i, 0);
  sim::Simulation simulation(make_chain(start, {0}, 3), registry, {.dt = 0.005});
  REQUIRE(run(simulation, 2000));
  CHECK(largest_distance(simulation, rest) <= 1e-12);
  CHECK(largest_force(make_chain(rest, {0}, 0), 0.25, registry) <= 1e-12);
}

TEST_CASE("a chain between two points hangs in the discrete catenary") {
  sim::Registry registry = make_registry();
  const std::vector<sim::Vec3> rest = points_of("catenary.csv");
  std::vector<sim::Vec3> start;
  for (int i = 0; i <= 10; ++i)
    start.emplace_back(0.15 * i, -std::sin(i * std::numbers::pi / 10), 0.01 * i * (10 - i));
  start.back().y() = 0;
  sim::Simulation simulation(make_chain(start, {0, 10}, 1), registry, {.dt = 0.01});
  REQUIRE(run(simulation, 6000));
  CHECK(largest_distance(simulation, rest) <= 1e-12);
  CHECK(largest_force(make_chain(rest, {0, 10}, 0), 0.25, registry) <= 1e-12);
}

TEST_CASE("the cloth comes to rest where the reference says") {
  sim::Registry registry = make_registry();
  const std::vector<sim::Vec3> rest = points_of("cloth8_rest.csv");
  const sim::SystemSpec cloth = make_cloth(8);
  sim::Simulation simulation(cloth, registry, {.dt = 0.01});
  REQUIRE(run(simulation, 5000));
  CHECK(largest_distance(simulation, rest) <= 1e-12);
  CHECK(simulation.energy().potential == Approx(-4.554761629319607).epsilon(1e-13));
  CHECK(simulation.energy().kinetic <= 1e-26);
  CHECK(largest_force(moved_to(cloth, rest), 1.0 / 64, registry) <= 1e-12);
}

TEST_CASE("come_to_rest finds what a long damped run ends in") {
  sim::Registry registry = make_registry();
  SECTION("a vertical chain") {
    std::vector<sim::Vec3> start;
    for (int i = 0; i <= 10; ++i) start.emplace_back(0.02 * i, -0.25 * i, 0.01 * i * i);
    sim::Simulation simulation(make_chain(start, {0}, 0), registry, {.dt = 0.005});
    const sim::study::Rest rest = sim::study::come_to_rest(simulation);
    CHECK(rest.found);
    CHECK(rest.force <= 1e-10);
    CHECK(largest_distance(simulation, vertical_chain()) <= 1e-10);
    CHECK(simulation.velocity(5) == sim::Vec3::Zero());
    CHECK(simulation.t() == 0);
  }
  SECTION("a catenary") {
    std::vector<sim::Vec3> start;
    for (int i = 0; i <= 10; ++i)
      start.emplace_back(0.15 * i, -std::sin(i * std::numbers::pi / 10), 0.01 * i * (10 - i));
    start.back().y() = 0;
    sim::Simulation simulation(make_chain(start, {0, 10}, 0), registry, {.dt = 0.01});
    CHECK(sim::study::come_to_rest(simulation).found);
    CHECK(largest_distance(simulation, points_of("catenary.csv")) <= 1e-10);
  }
  SECTION("a cloth, from flat") {
    sim::Simulation simulation(make_cloth(8), registry, {.dt = 0.01});
    const sim::study::Rest rest = sim::study::come_to_rest(simulation);
    CHECK(rest.found);
    CHECK(rest.potential == Approx(-4.554761629319607).epsilon(1e-12));
    CHECK(largest_distance(simulation, points_of("cloth8_rest.csv")) <= 1e-9);
  }
  SECTION("what falls has none") {
    sim::Simulation simulation(make_falling(1, 0), registry, {.dt = 0.01});
    const sim::study::Rest rest = sim::study::come_to_rest(simulation);
    CHECK(!rest.found);
    CHECK(rest.why == "particle 0 moves away without end, along (0, -1, 0)");
  }
  SECTION("a field has no forces") {
    sim::Simulation simulation(make_circle(), registry, {.dt = 0.01});
    CHECK_THROWS_WITH(sim::study::come_to_rest(simulation), Catch::Contains("first-order"));
  }
}
