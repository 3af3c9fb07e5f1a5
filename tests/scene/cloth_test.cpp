// The 8 x 8 cloth against its reference, and what holds for every cloth.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <sstream>

#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

std::vector<int> numbers(const std::string& text) {
  std::istringstream in(text);
  std::vector<int> list;
  for (int value; in >> value;) list.push_back(value);
  return list;
}

std::vector<int> neighbours(const sim::Simulation& cloth, int i, const std::string& family) {
  std::vector<int> list;
  for (const sim::Link& link : cloth.links(i))
    if (link.family == family) list.push_back(link.to);
  return list;
}

}  // namespace

TEST_CASE("the 8 x 8 cloth follows the reference") {
  sim::Registry registry = make_registry();
  sim::Simulation cloth(make_cloth(8), registry, {.dt = 1e-4});
  const Table energies("cloth8_energy.csv"), states("cloth8.csv");
  for (const Row& energy : energies.rows()) {
    const double t = energy.number("t");
    REQUIRE(run(cloth, std::lround(t / 1e-4) - cloth.step_count()));
    double position_error = 0, velocity_error = 0;
    for (const Row& row : states.rows_where("t", t)) {
      const int i = static_cast<int>(row.number("particle"));
      const sim::Vec3 x(row.number("x"), row.number("y"), row.number("z"));
      const sim::Vec3 v(row.number("vx"), row.number("vy"), row.number("vz"));
      position_error = std::max(position_error, (cloth.position(i) - x).norm());
      velocity_error = std::max(velocity_error, (cloth.velocity(i) - v).norm());
    }
    INFO("t " << t);
    CHECK(position_error <= 1e-8);
    CHECK(velocity_error <= 1e-6);
    CHECK(cloth.energy().kinetic == Approx(energy.number("kinetic")).margin(1e-7));
    CHECK(cloth.energy().potential ==
          Approx(energy.number("gravitational") + energy.number("elastic")).margin(1e-7));
  }
}

TEST_CASE("a cloth has the springs that its size says") {
  sim::Registry registry = make_registry();
  for (long n = 2; n <= 64; ++n) {
    const sim::Simulation cloth(make_cloth(static_cast<int>(n)), registry);
    const std::vector<std::pair<std::string, long>> expected = {{"structural", 2 * n * (n - 1)},
                                                                {"shear", 2 * (n - 1) * (n - 1)},
                                                                {"flex", 2 * n * (n - 2)}};
    CHECK(cloth.families() == expected);
  }
  const Table table("cloth_counts.csv");
  for (const Row& row : table.rows()) {
    const sim::Simulation cloth(make_cloth(static_cast<int>(row.number("n"))), registry);
    for (const auto& [family, count] : cloth.families())
      CHECK(static_cast<double>(count) == row.number(family));
  }
}

TEST_CASE("every particle of a cloth has the neighbours that the offsets say") {
  sim::Registry registry = make_registry();
  const std::map<std::string, std::vector<std::pair<int, int>>> offsets = {
      {"structural", {{-1, 0}, {0, -1}, {0, 1}, {1, 0}}},
      {"shear", {{-1, -1}, {-1, 1}, {1, -1}, {1, 1}}},
      {"flex", {{-2, 0}, {0, -2}, {0, 2}, {2, 0}}}};
  for (int n = 2; n <= 64; ++n) {
    const sim::Simulation cloth(make_cloth(n), registry);
    bool right = true;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const std::vector<sim::Link> links = cloth.links(i * n + j);
        std::size_t next = 0;
        for (const char* family : {"structural", "shear", "flex"})
          for (const auto& [di, dj] : offsets.at(family)) {
            if (i + di < 0 || i + di >= n || j + dj < 0 || j + dj >= n) continue;
            right = right && next < links.size() && links[next].family == family &&
                    links[next].to == (i + di) * n + j + dj;
            ++next;
          }
        right = right && next == links.size();
      }
    INFO("n " << n);
    CHECK(right);
  }
}

TEST_CASE("the 8 x 8 cloth has the listed adjacency") {
  sim::Registry registry = make_registry();
  const sim::Simulation cloth(make_cloth(8), registry);
  const Table table("cloth8_adjacency.csv");
  CHECK(table.rows().size() == 64);
  for (const Row& row : table.rows()) {
    const int i = static_cast<int>(row.number("particle"));
    for (const char* family : {"structural", "shear", "flex"})
      CHECK(neighbours(cloth, i, family) == numbers(row.text(family)));
  }
  const std::map<std::string, std::pair<double, double>> numbers_of = {
      {"structural", {100, 0.125}}, {"shear", {50, std::sqrt(2.0) / 8}}, {"flex", {25, 0.25}}};
  REQUIRE(cloth.links(12).size() == 11);
  for (const sim::Link& link : cloth.links(12)) {
    CHECK(link.stiffness == numbers_of.at(link.family).first);
    CHECK(link.rest == numbers_of.at(link.family).second);
  }
}

TEST_CASE("a free cloth keeps its momentum and its angular momentum") {
  sim::Registry registry = make_registry();
  for (const std::string method : {"euler", "trapezoid", "rk4"}) {
    sim::SystemSpec spec = make_cloth(12, {.gravity = false, .pinned = false, .drag = 0});
    // Particles one by one, each with a velocity of its own; sizes of 1 m/s.
    std::vector<sim::ParticleSpec> list;
    for (int i = 0; i < 144; ++i) {
      list.push_back(spec.particles->at(i));
      list.back().velocity = {std::sin(1.0 + i), std::sin(2.0 + 3 * i), std::sin(3.0 + 7 * i)};
    }
    spec.particles->grid.reset();
    spec.particles->list = list;
    sim::Simulation cloth(spec, registry, {.integrator = method, .dt = 1e-4});
    const auto moments = [&cloth] {
      sim::Vec3 linear = sim::Vec3::Zero(), angular = sim::Vec3::Zero();
      for (int i = 0; i < 144; ++i) {
        linear += cloth.velocity(i) / 144;
        angular += cloth.position(i).cross(cloth.velocity(i)) / 144;
      }
      return std::pair(linear, angular);
    };
    const auto [linear, angular] = moments();
    REQUIRE(run(cloth, 1000));
    INFO(method);
    CHECK((moments().first - linear).norm() <= 1e-14);
    // No Runge-Kutta method here keeps a quadratic invariant; rk4 keeps it to its own accuracy.
    if (method == "rk4") CHECK((moments().second - angular).norm() <= 1e-9);
  }
}

TEST_CASE("energy: a cloth without drag keeps it better the higher the order") {
  sim::Registry registry = make_registry();
  std::vector<double> drift;
  for (const std::string method : {"euler", "trapezoid", "rk4"}) {
    sim::Simulation cloth(make_cloth(6, {.drag = 0}), registry, {.integrator = method, .dt = 1e-4});
    const double start = cloth.energy().total();
    REQUIRE(run(cloth, 5000));
    drift.push_back(std::abs(cloth.energy().total() - start));
  }
  CHECK(drift[0] > 100 * drift[1]);
  CHECK(drift[1] > 100 * drift[2]);
  CHECK(drift[2] < 1e-7);
}

TEST_CASE("springs of several forces with one family are counted together") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_cloth(2);
  sim::PartSpec first = make_springs("tie", 5), other = make_springs("rod", 6),
                last = make_springs("tie", 7);
  first.elements.add({0, 1});
  other.elements.add({1, 2});
  last.elements.add({2, 3});
  last.elements.add({0, 3});
  spec.forces = {first, other, last};
  const sim::Simulation system(spec, registry);
  CHECK(system.families() == std::vector<std::pair<std::string, long>>{{"tie", 3}, {"rod", 1}});
}
