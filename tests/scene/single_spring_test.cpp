// One particle on one spring: the exactly linear vertical oscillator and the elastic pendulum.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

// The vertical spring with the force -k (x - anchor) everywhere: a rest length of 0.
sim::SystemSpec make_linear_spring(double drag) {
  sim::SystemSpec spec = make_vertical_spring(drag);
  spec.particles->list[0].position = {0, -1, 0};
  spec.forces[1].elements.values["rest"] = {0};
  return spec;
}

void check_against(const Row& row, const sim::SystemSpec& spec, sim::Registry& registry) {
  const double h = row.number("h"), y = row.number("y"), vy = row.number("vy");
  sim::Simulation simulation(spec, registry, {.integrator = row.text("method"), .dt = h});
  REQUIRE(run(simulation, static_cast<std::int64_t>(row.number("n"))));
  INFO(row.text("method") << " h " << h << " drag " << row.number("drag"));
  const double scale = std::abs(y) + std::abs(vy);
  CHECK(std::abs(simulation.position(1).y() - y) <= 1e-12 * scale);
  CHECK(std::abs(simulation.velocity(1).y() - vy) <= 1e-12 * scale);
  CHECK(simulation.position(1).x() == 0);
  CHECK(simulation.position(1).z() == 0);
}

}  // namespace

TEST_CASE("each method takes exactly its own discrete path on a linear spring") {
  sim::Registry registry = make_registry();
  int stable = 0;
  const Table table("vertical_spring_discrete.csv");
  for (const Row& row : table.rows()) {
    check_against(row, make_linear_spring(row.number("drag")), registry);
    if (std::abs(row.number("y")) > 1.5) continue;
    check_against(row, make_vertical_spring(row.number("drag")), registry);
    ++stable;
  }
  CHECK(stable >= 9);
}

TEST_CASE("the vertical spring follows the closed form") {
  sim::Registry registry = make_registry();
  const Table table("vertical_spring.csv");
  for (const Row& row : table.rows()) {
    const double t = row.number("t"), h = 1.0 / 4000;
    sim::Simulation simulation(make_vertical_spring(row.number("drag")), registry, {.dt = h});
    REQUIRE(run(simulation, simulation.steps_for(t)));
    CHECK(simulation.t() == Approx(t).epsilon(1e-14));
    INFO("drag " << row.number("drag") << " t " << t);
    CHECK(std::abs(simulation.position(1).y() - row.number("y")) <= 1e-11);
    CHECK(std::abs(simulation.velocity(1).y() - row.number("vy")) <= 1e-10);
  }
}

TEST_CASE("the elastic pendulum follows the reference") {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(make_elastic_pendulum(), registry, {.dt = 1.0 / 4096});
  const Table table("elastic_pendulum.csv");
  for (const Row& row : table.rows()) {
    const double t = row.number("t");
    REQUIRE(run(simulation, static_cast<std::int64_t>(t * 4096) - simulation.step_count()));
    REQUIRE(simulation.t() == t);
    INFO("t " << t);
    const sim::Vec3 x = simulation.position(1), v = simulation.velocity(1);
    const sim::Vec3 x_ref(row.number("x"), row.number("y"), row.number("z"));
    const sim::Vec3 v_ref(row.number("vx"), row.number("vy"), row.number("vz"));
    CHECK((x - x_ref).cwiseAbs().maxCoeff() <= 1e-10);
    CHECK((v - v_ref).cwiseAbs().maxCoeff() <= 1e-9);
    CHECK(simulation.energy().kinetic == Approx(row.number("kinetic")).margin(1e-9));
    CHECK(simulation.energy().potential ==
          Approx(row.number("gravitational") + row.number("elastic")).margin(1e-9));
    // The angular momentum about the vertical axis.
    CHECK(x.z() * v.x() - x.x() * v.z() == Approx(0.36).margin(1e-11));
  }
}

TEST_CASE("the elastic pendulum starts with the energy of its spring, height and speed") {
  sim::Registry registry = make_registry();
  const sim::Simulation simulation(make_elastic_pendulum(), registry);
  CHECK(simulation.energy().kinetic == Approx(0.15).epsilon(1e-15));
  CHECK(simulation.energy().potential == Approx(-8.829 + 0.3001113587127034).epsilon(1e-14));
  CHECK(simulation.energy().total() == Approx(-8.378888641287297).epsilon(1e-14));
}
