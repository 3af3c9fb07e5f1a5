// Defaults of plugins, and parameters of any scale, by closed forms.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/particles/elements/cells.h"
#include "core/particles/rigid_motion.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Vec3;

namespace {

constexpr double kYoung = 5.2, kPoisson = 0.3;
constexpr double kMu = kYoung / (2 * (1 + kPoisson));
constexpr double kLambda = kYoung * kPoisson / ((1 + kPoisson) * (1 - 2 * kPoisson));

// A free block of 1 m x 1 m x 1 m that says nothing of its law.
sim::SystemSpec make_block() {
  sim::SystemSpec spec;
  spec.name = "block";
  spec.integrator = "euler";
  spec.dt = 1;
  sim::GridSpec& grid = spec.particles.emplace().grid.emplace();
  grid.size = {3, 3, 3};
  grid.directions = 3;
  grid.du = {0.5, 0, 0};
  grid.dv = {0, 0.5, 0};
  grid.dw = {0, 0, 0.5};
  sim::PartSpec solid = make_part("solid", {{"young", kYoung}, {"density", 8.0}});
  solid.elements.cells = true;
  solid.elements.arity = 4;
  solid.elements.ids = sim::grid_cells(grid.size, 1);
  spec.forces = {solid};
  sim::weigh_cells(spec);
  return spec;
}

void strain(sim::Simulation& block, const sim::Mat3& e) {
  for (int i = 0; i < block.particles(); ++i)
    block.set_position(i, block.position(i) + e * block.position(i));
}

// Hooke's law: mu e:e + lambda/2 tr(e)^2 of a volume of 1 m^3.
double hooke(const sim::Mat3& e) {
  double square = 0, trace = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    trace += e(i, i);
    for (std::size_t j = 0; j < 3; ++j) square += e(i, j) * e(i, j);
  }
  return kMu * square + 0.5 * kLambda * trace * trace;
}

// A pair of particles of 1 kg so far apart; its energy, and the force on the first.
struct Pair {
  double energy, force;
};
Pair pair_at(double distance, std::map<std::string, sim::Value> given) {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec;
  spec.name = "pair";
  spec.integrator = "euler";
  spec.dt = 1;
  spec.particles.emplace().list = {{{0, 0, 0}}, {{distance, 0, 0}}};
  spec.forces = {make_part("pair", std::move(given))};
  sim::Simulation pair(spec, registry);
  const double energy = pair.energy().potential;
  REQUIRE(pair.step());
  return {energy, pair.velocity(0).x()};
}

}  // namespace

TEST_CASE("a solid that names no law follows Hooke in small strain") {
  sim::Registry registry = make_registry();
  constexpr double kSmall = 1e-5;
  for (const sim::Mat3& shape :
       {sim::Mat3({1, 0, 0}, {0, 0, 0}, {0, 0, 0}), sim::Mat3({0, 1, 0}, {1, 0, 0}, {0, 0, 0}),
        sim::Mat3({1, 0, 0}, {0, 1, 0}, {0, 0, 1}),
        sim::Mat3({1, 0.3, -0.2}, {0.3, -0.7, 0.5}, {-0.2, 0.5, 0.4})}) {
    const sim::Mat3 e = kSmall * shape;
    sim::Simulation block(make_block(), registry);
    strain(block, e);
    CHECK(block.energy().potential == Approx(hooke(e)).epsilon(1e-4));
  }

  // Stretched along x and as much thinner as it likes: E e over the end, nothing at the sides.
  sim::Simulation block(make_block(), registry);
  sim::Mat3 e({kSmall, 0, 0}, {0, -kPoisson * kSmall, 0}, {0, 0, -kPoisson * kSmall});
  strain(block, e);
  REQUIRE(block.step());
  const sim::SystemSpec spec = make_block();
  Vec3 end;
  double side = 0;
  for (int i = 0; i < block.particles(); ++i) {
    const sim::ParticleSpec particle = spec.particles->at(i);
    const Vec3 force = particle.mass * block.velocity(i);
    if (particle.position.x() > 0.9) end += force;
    side = std::max({side, std::fabs(force.y()), std::fabs(force.z())});
  }
  CHECK(end.x() == Approx(-kYoung * kSmall).epsilon(1e-4));
  CHECK(side < 1e-4 * kYoung * kSmall);
}

TEST_CASE("a pair law that names no cutoff ends where its description says") {
  const auto lennard_jones = [](double r) {
    const double s = std::pow(0.8 / r, 6);
    return 4 * 3 * (s * s - s);
  };
  const auto morse = [](double r) {
    const double e = std::exp(-4 * (r - 0.5));
    return 2 * (e * e - 2 * e);
  };
  const struct {
    std::map<std::string, sim::Value> given;
    double cutoff;  // m
    std::function<double(double)> energy;
  } laws[] = {{{{"epsilon", 3.0}, {"sigma", 0.8}}, 2.5 * 0.8, lennard_jones},
              {{{"potential", std::string("morse")}, {"depth", 2.0}, {"r0", 0.5}, {"a", 4.0}},
               0.5 + 6 / 4.0,
               morse},
              {{{"potential", std::string("soft")}, {"k", 7.0}, {"radius", 1.5}},
               1.5,
               [](double r) { return 3.5 * (1.5 - r) * (1.5 - r); }}};
  for (const auto& law : laws) {
    INFO("cutoff " << law.cutoff);
    for (const double share : {0.5, 0.9, 0.999}) {
      const double r = share * law.cutoff, d = 1e-6;
      const Pair pair = pair_at(r, law.given);
      CHECK(pair.energy == Approx(law.energy(r) - law.energy(law.cutoff)).epsilon(1e-9));
      // The first particle is pushed against x where U falls with the distance.
      CHECK(pair.force == Approx((law.energy(r + d) - law.energy(r - d)) / (2 * d)).epsilon(1e-6));
    }
    const Pair beyond = pair_at(1.0001 * law.cutoff, law.given);
    CHECK(beyond.energy == 0);
    CHECK(beyond.force == 0);
  }
}

TEST_CASE("the axis of a motion may have any length") {
  sim::Registry registry = make_registry();
  const auto motion = [&](const std::string& name, std::map<std::string, sim::Value> given) {
    const auto& plugin = registry.get<sim::RigidMotion>(name);
    return plugin.make(sim::Params(plugin.title(), plugin.params, given, ""));
  };
  constexpr double kTurn = 2 * std::numbers::pi;
  for (const double length : {1e-200, 0.5, 1.0, 7.0, 1e200}) {
    INFO(length);
    // Turned about z by an eighth of a turn: (1, 0, 0) comes to (1, 1, 0) / sqrt(2).
    const auto spin = motion("spin", {{"axis", Vec3(0, 0, length)}, {"period", 8.0}});
    const sim::Pose turned = spin->at(1, {1, 2, 3});
    CHECK((turned.turned({1, 0, 0}) - Vec3(1, 1, 0) / std::sqrt(2)).norm() < 1e-15);
    CHECK(turned.axis.norm() == Approx(1).epsilon(1e-15));
    const Vec3 velocity = turned.velocity_at(turned.center + Vec3(2, 0, 0));
    CHECK((velocity - Vec3(0, 2 * kTurn / 8, 0)).norm() < 1e-15);
    CHECK(spin->max_angular_speed() == Approx(kTurn / 8));

    // Round the center in a circle of 2 m in the plane across (3, 4, 0): from the side of x,
    // (0.8, -0.6, 0), by a quarter of a turn to axis x side, (0, 0, -1).
    const auto orbit =
        motion("orbit", {{"axis", length * Vec3(0.6, 0.8, 0)}, {"radius", 2.0}, {"period", 4.0}});
    const Vec3 center(1, 1, 1);
    CHECK((orbit->at(0, center).center - center - 2 * Vec3(0.8, -0.6, 0)).norm() < 1e-14);
    CHECK((orbit->at(1, center).center - center - 2 * Vec3(0, 0, -1)).norm() < 1e-14);
    CHECK((orbit->at(0, center).velocity - kTurn / 4 * 2 * Vec3(0, 0, -1)).norm() < 1e-14);
  }
}
