// Forces on surfaces: pressure and bending.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/geometry/triangle_mesh.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

using Size = std::array<int, 3>;

// Free particles of 1 kg at the places of a grid with its surface as a parameter of one force.
template <class SourceLocation>
sim::SystemSpec make_surface(const std::string& force, std::map<std::string, sim::Value> given,
                             const Size& size, SourceLocation place) {
  sim::SystemSpec spec;
  spec.name = "surface";
  spec.integrator = "euler";
  spec.dt = 1;
  spec.particles.emplace();
  for (int i = 0; i < size[0]; ++i)
    for (int j = 0; j < size[1]; ++j)
      for (int k = 0; k < size[2]; ++k)
        spec.particles->list.push_back({.position = place(i, j, k)});
  given["surface"] = std::make_shared<const sim::TriangleMesh>(spec.particles->count(),
                                                               sim::grid_triangles(size, false));
  spec.forces = {make_part(force, std::move(given))};
  return spec;
}

// Positions without any symmetry.
sim::Vec3 dented(int i, int j, int k) {
  return {i + 0.2 * std::sin(1.0 + 3 * j + 5 * k), j + 0.2 * std::sin(2.0 + 7 * i + k),
          k + 0.3 * std::sin(3.0 + i * j)};
}

sim::SystemSpec make_dented(const std::string& force) {
  if (force == "pressure") return make_surface(force, {{"pressure", 3.0}}, {4, 3, 4}, dented);
  return make_surface(force, {{"stiffness", 2.0}}, {6, 5, 1}, dented);
}

// One Euler step of 1 s gives each particle of 1 kg at rest the force on it as its velocity.
std::vector<sim::Vec3> forces_of(const sim::SystemSpec& spec, sim::Registry& registry) {
  sim::Simulation simulation(spec, registry);
  REQUIRE(simulation.step());
  std::vector<sim::Vec3> forces;
  for (int i = 0; i < simulation.particles(); ++i) forces.push_back(simulation.velocity(i));
  return forces;
}

double largest(const std::vector<sim::Vec3>& list) {
  double most = 0;
  for (const sim::Vec3& v : list) most = std::max(most, v.cwiseAbs().maxCoeff());
  return most;
}

}  // namespace

TEST_CASE("forces on surfaces are minus the gradient of their energy") {
  sim::Registry registry = make_registry();
  for (const char* force : {"pressure", "bending"}) {
    const sim::SystemSpec spec = make_dented(force);
    // At another shape than that at the start, from which bending takes its constants.
    sim::Simulation simulation(spec, registry, {.dt = 0.05});
    REQUIRE(run(simulation, 2));
    const auto potential = [&] { return simulation.energy().potential; };

    std::vector<sim::Vec3> forces;
    const double h = 1e-5;
    for (int i = 0; i < simulation.particles(); ++i) {
      const sim::Vec3 x = simulation.position(i);
      sim::Vec3 force_on_i;
      for (int axis = 0; axis < 3; ++axis) {
        double energy[2];
        for (const int side : {0, 1}) {
          sim::Vec3 moved = x;
          moved[axis] += side ? h : -h;
          simulation.set_position(i, moved);
          energy[side] = potential();
        }
        force_on_i[axis] = -(energy[1] - energy[0]) / (2 * h);
      }
      simulation.set_position(i, x);
      forces.push_back(force_on_i);
    }
    // The forces themselves: the change of velocity in the next step.
    std::vector<sim::Vec3> before;
    for (int i = 0; i < simulation.particles(); ++i) before.push_back(simulation.velocity(i));
    REQUIRE(simulation.step());
    INFO(force);
    const double size = largest(forces);
    CHECK(size > 0.1);
    for (int i = 0; i < simulation.particles(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      const sim::Vec3 found = (simulation.velocity(i) - before[at]) / 0.05;
      CHECK((found - forces[at]).cwiseAbs().maxCoeff() <= 1e-7 * size);
    }
  }
}

TEST_CASE("forces on closed and on free surfaces neither push nor turn the whole") {
  sim::Registry registry = make_registry();
  for (const char* force : {"pressure", "bending"}) {
    const sim::SystemSpec spec = make_dented(force);
    const std::vector<sim::Vec3> forces = forces_of(spec, registry);
    sim::Vec3 sum = sim::Vec3::Zero(), torque = sim::Vec3::Zero();
    for (std::size_t i = 0; i < forces.size(); ++i) {
      sum += forces[i];
      torque += spec.particles->list[i].position.cross(forces[i]);
    }
    INFO(force);
    const double size = largest(forces);
    CHECK(sum.cwiseAbs().maxCoeff() <= 1e-13 * size);
    CHECK(torque.cwiseAbs().maxCoeff() <= 1e-12 * size);
  }
}

TEST_CASE("pressure is p A n, a third of each triangle on a corner") {
  sim::Registry registry = make_registry();
  // One cell of 2 m x 3 m: triangles (0, 2, 3) and (0, 3, 1) around the diagonal from 0 to 3.
  const auto place = [](int i, int j, int) { return sim::Vec3(2 * i, 3 * j, 1); };
  const std::vector<sim::Vec3> forces =
      forces_of(make_surface("pressure", {{"pressure", 5.0}}, {2, 2, 1}, place), registry);
  CHECK(forces[0] == sim::Vec3(0, 0, 10));
  CHECK(forces[1] == sim::Vec3(0, 0, 5));
  CHECK(forces[2] == sim::Vec3(0, 0, 5));
  CHECK(forces[3] == sim::Vec3(0, 0, 10));

  // A block of 1 m: -p V.
  const auto cube = [](int i, int j, int k) { return sim::Vec3(i / 3.0, j / 3.0, k / 3.0); };
  const sim::SystemSpec spec = make_surface("pressure", {{"pressure", 5.0}}, {4, 4, 4}, cube);
  CHECK(sim::Simulation(spec, registry).energy().potential == Approx(-5).epsilon(1e-14));
}

TEST_CASE("bending has the energy of a bent plate, whatever its direction on the mesh") {
  sim::Registry registry = make_registry();
  const double radius = 2, side = 1, stiffness = 3;
  const double exact = 0.5 * stiffness * side * side / (radius * radius);
  for (const double angle : {0.0, 0.3, M_PI / 4, M_PI / 2, -M_PI / 4}) {
    // The sheet rolled on a cylinder whose axis has that angle with the first direction.
    double error[2];
    for (const int fine : {0, 1}) {
      const int n = fine ? 41 : 21;
      const auto rolled = [&](int i, int j, int) {
        const double u = side * i / (n - 1), v = side * j / (n - 1);
        const double along = std::cos(angle) * u + std::sin(angle) * v;
        const double across = (-std::sin(angle) * u + std::cos(angle) * v) / radius;
        return sim::Vec3(along, radius * std::sin(across), radius * std::cos(across));
      };
      const sim::SystemSpec spec =
          make_surface("bending", {{"stiffness", stiffness}}, {n, n, 1}, rolled);
      error[fine] = sim::Simulation(spec, registry).energy().potential / exact - 1;
    }
    INFO("angle " << angle << ": " << error[0] << ", " << error[1]);
    // The boundary does not bend: a strip of half a cell is missing, or less.
    CHECK(std::abs(error[1]) < 0.03);
    CHECK(std::abs(error[1]) < 0.6 * std::abs(error[0]));
  }
}

TEST_CASE("a flat sheet stays where it is, however it lies in space") {
  sim::Registry registry = make_registry();
  const auto tilted = [](int i, int j, int) {
    return sim::Vec3(1000 + 0.1 * i, 0.06 * i + 0.1 * j, 0.05 * j);
  };
  const sim::SystemSpec spec = make_surface("bending", {{"stiffness", 1.0}}, {7, 9, 1}, tilted);
  // k / a^2 = 100 N/m times the rounding of the coordinates.
  CHECK(largest(forces_of(spec, registry)) < 1e-9);
  CHECK(sim::Simulation(spec, registry).energy().potential < 1e-20);
}

TEST_CASE("forces on surfaces are the same on any number of threads, and conserve energy") {
  sim::Registry registry = make_registry();
  for (const char* force : {"pressure", "bending"}) {
    sim::SystemSpec spec = make_cloth(97, {.drag = 0});
    sim::PartSpec part = make_part(force, {});
    part.given["surface"] =
        std::make_shared<const sim::TriangleMesh>(97 * 97, sim::grid_triangles({97, 97, 1}, false));
    part.given[std::string(force) == "pressure" ? "pressure" : "stiffness"] =
        std::string(force) == "pressure" ? 1.0 : 1e-4;
    spec.forces.push_back(part);
    INFO(force);
    for (const char* method : {"rk4", "verlet"}) {
      std::uint64_t hash = 0;
      for (const int threads : {1, 2, 3, 4}) {
        sim::Simulation cloth(spec, registry,
                              {.integrator = method, .dt = 1e-4, .threads = threads});
        REQUIRE(run(cloth, 4));
        if (threads == 1) hash = cloth.hash();
        CHECK(cloth.hash() == hash);
      }
    }
  }
  for (const char* force : {"pressure", "bending"}) {
    sim::SystemSpec spec = make_dented(force);
    sim::Simulation body(spec, registry, {.integrator = {"dop853", {{"tol", 1e-12}}}, .dt = 0.1});
    const double start = body.energy().kinetic + body.energy().potential;
    REQUIRE(run(body, 5));
    const double kinetic = body.energy().kinetic;
    INFO(force);
    CHECK(kinetic > 0.01);
    CHECK(kinetic + body.energy().potential == Approx(start).margin(1e-9 * kinetic));
  }
}

TEST_CASE("implicit methods take long steps with stiff bending") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_cloth(16, {.drag = 0.5});
  sim::PartSpec part = make_part("bending", {{"stiffness", 10.0}});
  part.given["surface"] =
      std::make_shared<const sim::TriangleMesh>(256, sim::grid_triangles({16, 16, 1}, false));
  spec.forces.push_back(part);
  // Explicit methods need steps far below 2 / sqrt(64 k / (m a^2)), about 0.1 ms.
  sim::Simulation cloth(spec, registry, {.integrator = "implicit_euler", .dt = 0.02});
  REQUIRE(run(cloth, 50));
  CHECK(cloth.position(128).norm() < 3);
  CHECK(cloth.energy().kinetic < 10);
}

TEST_CASE("a force that is kept to some particles acts on them as on all") {
  sim::Registry registry = make_registry();
  registry.load(std::string(SIM_FIXTURE_DIR) + "/air_drag/air_drag.so");
  std::vector<int> odd, all;
  for (int i = 0; i < 36; ++i) {
    all.push_back(i);
    if (i % 2 || i > 30) odd.push_back(i);
  }
  const sim::PartSpec parts[] = {make_gravity(), make_drag(0.3),
                                 make_part("air_drag", {{"c", 0.02}}),
                                 make_part("gust", {{"c", 0.4}})};
  for (const sim::PartSpec& part : parts) {
    INFO(part.plugin);
    sim::SystemSpec spec = make_cloth(6, {.gravity = false, .drag = 0});
    spec.forces = {part};
    for (int i = 0; i < 36; ++i) {
      spec.particles->list.push_back(spec.particles->at(i));
      spec.particles->list.back().velocity = {1, 0.1 * i, -2};
    }
    spec.particles->grid.reset();
    const auto moved = [&](std::optional<std::vector<int>> group, const char* method) {
      spec.forces[0].particles = std::move(group);
      sim::Simulation system(spec, registry, {.integrator = method, .dt = 0.01});
      REQUIRE(run(system, 3));
      return system;
    };
    std::vector<const char*> methods = {"rk4", "implicit_midpoint"};
    if (part.plugin == "gravity") methods.push_back("verlet");  // its views have no velocities
    for (const char* method : methods) {
      const sim::Simulation free = moved({}, method), every = moved(all, method),
                            some = moved(odd, method), none = moved(std::vector<int>{}, method);
      // Newton's method stops at 1e-8 of the residual, and both runs have residuals of their own.
      const double least = some.integrator_info().implicit ? 1e-8 : 1e-14;
      CHECK(every.energy().potential == Approx(free.energy().potential).margin(1e-12));
      for (int i = 0; i < 36; ++i) {
        CHECK((every.position(i) - free.position(i)).cwiseAbs().maxCoeff() <= least);
        const bool member = std::ranges::find(odd, i) != odd.end();
        const sim::Simulation& like = member ? free : none;
        CHECK((some.velocity(i) - like.velocity(i)).cwiseAbs().maxCoeff() <= least);
      }
      CHECK(none.energy().potential == 0);
    }
  }
  sim::SystemSpec spec = make_cloth(6);
  spec.forces[2].particles = all;
  CHECK_THROWS_WITH(sim::Simulation(spec, registry), Catch::Contains("kept to some particles"));
  spec = make_cloth(6);
  for (const std::vector<int>& wrong :
       std::vector<std::vector<int>>{{36}, {0, 36}, {-1}, {-1, 3}, {4, 3}, {3, 3}, {0, 400}}) {
    spec.forces[0].particles = wrong;
    CHECK_THROWS_WITH(sim::Simulation(spec, registry), Catch::Contains("ascending ids"));
  }
  for (const std::vector<int>& right : std::vector<std::vector<int>>{{}, {0}, {35}, {0, 35}}) {
    spec.forces[0].particles = right;
    CHECK_NOTHROW(sim::Simulation(spec, registry));
  }
}
