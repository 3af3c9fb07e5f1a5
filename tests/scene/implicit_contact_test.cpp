// Contact inside the equations of implicit methods.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/study/energy_balance.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Vec3;

namespace {

const char* const kImplicit[] = {"implicit_euler", "implicit_midpoint", "trbdf2", "bdf2"};

// A chain of 31 beads of 0.1 kg, 0.1 m apart, that hangs over a cylinder of 0.5 m.
sim::SystemSpec make_hung_chain() {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list.clear();
  spec.forces = {make_gravity(), make_drag(1), make_springs("link", 1e4)};
  const double radius = 0.5 + 1e-9, quarter = 0.5 * 3.141592653589793 * radius;
  for (int i = 0; i < 31; ++i) {
    const double l = 0.1 * (i - 15), side = l < 0 ? -1 : 1, down = std::abs(l) - quarter;
    const Vec3 place = down < 0
                           ? Vec3(radius * std::sin(l / radius), radius * std::cos(l / radius), 0)
                           : Vec3(side * radius, -down, 0);
    spec.particles->list.push_back({.position = place, .mass = 0.1});
    if (i > 0) spec.forces.back().elements.add({i - 1, i});
  }
  spec.particles->pinned = {15};  // else it slides off in the long run
  spec.colliders = {
      make_part("capsule", {{"a", Vec3(0, 0, -1)}, {"b", Vec3(0, 0, 1)}, {"radius", 0.5}})};
  return spec;
}

double depth(const sim::Simulation& system, const Vec3& center, double radius) {
  double deepest = 0;
  for (int i = 0; i < system.particles(); ++i)
    deepest = std::max(deepest, radius - (system.position(i) - center).norm());
  return deepest;
}

// The ratio of the position errors at the end for a doubling of the steps: from 37 to 2368, against
// many steps of rk4.
double order_of(const sim::SystemSpec& spec, const std::string& method, double duration) {
  sim::Registry registry = make_registry();
  const auto end_of = [&](const std::string& name, int steps) {
    sim::Simulation system(spec, registry, {.integrator = {name}, .dt = duration / steps});
    REQUIRE(run(system, steps));
    CHECK(depth(system, {0, 0, 0}, spec.colliders[0].plugin == "sphere" ? 1.0 : 0.0) < 1e-9);
    return system.position(0);
  };
  const Vec3 exact = end_of("rk4", 65536);
  const double coarse = (end_of(method, 37) - exact).norm();
  const double fine = (end_of(method, 2368) - exact).norm();
  INFO(method << " " << coarse << " " << fine);
  CHECK(fine < 5e-6);
  return std::log2(coarse / fine) / 6;
}

}  // namespace

TEST_CASE("a chain over a cylinder has the tension of its weight, whatever the implicit step") {
  sim::Registry registry = make_registry();
  const auto tension = [&](const std::string& method, double h, double duration) {
    sim::Simulation chain(make_hung_chain(), registry, {.integrator = {method}, .dt = h});
    const double rest = (chain.position(15) - chain.position(14)).norm();
    REQUIRE(run(chain, std::lround(duration / h)));
    CHECK(depth(chain, {0, 0, 0}, 0.5) < 1e-9);
    return 1e4 * ((chain.position(15) - chain.position(14)).norm() - rest);
  };
  const double exact = tension("verlet", 5e-4, 12);
  CHECK(exact == Approx(12.5).epsilon(0.01));
  for (const double h : {0.02, 0.01, 0.005, 0.0025})
    CHECK(tension("implicit_euler", h, 12) == Approx(exact).epsilon(1e-3));
  for (const char* method : {"trbdf2", "bdf2"})
    CHECK(tension(method, 0.01, 12) == Approx(exact).epsilon(1e-3));
}

TEST_CASE("implicit methods of second order are that at contact, too") {
  const double s = std::sin(0.2), c = std::cos(0.2);
  const sim::SystemSpec slides = make_particle({s, c, 0}, {0.5 * c, -0.5 * s, 0}, make_sphere());
  for (const char* method : {"implicit_midpoint", "trbdf2", "bdf2"}) {
    INFO(method);
    CHECK(order_of(slides, method, 0.4) > 1.8);
    CHECK(order_of(slides, method, 0.9) > 1.8);  // and off
    CHECK(order_of(make_particle({0.3, 1.5, 0}, {0, 0, 0}, make_sphere()), method, 0.6) > 1.8);
  }
  const sim::SystemSpec rough =
      make_particle({0, 0, 0}, {0.5 * std::cos(0.5), 0.5 * std::sin(0.5), 1}, make_slope(0.5, 0.5));
  CHECK(order_of(rough, "implicit_midpoint", 0.5) > 1.8);
}

TEST_CASE("a ball bounces in implicit methods as the closed form says") {
  sim::Registry registry = make_registry();
  const double up = 0.8 * std::sqrt(2 * kGravity), lands = std::sqrt(2 / kGravity);
  for (const char* method : {"implicit_midpoint", "trbdf2", "bdf2"}) {
    INFO(method);
    sim::Simulation ball(
        make_particle({0, 1, 0}, {0.5, 0, 0}, make_part("plane", {{"restitution", 0.8}})), registry,
        {.integrator = {method}, .dt = 0.0101});
    REQUIRE(run(ball, 108));
    const double after = ball.t() - lands;
    CHECK(ball.position(0).y() == Approx(up * after - 0.5 * kGravity * after * after));
    CHECK(ball.position(0).x() == Approx(0.5 * ball.t()));
  }
}

TEST_CASE("friction holds what the slope lets it hold, and brakes the rest") {
  sim::Registry registry = make_registry();
  const double angle = 0.5;
  for (const char* method : kImplicit) {
    INFO(method);
    sim::Simulation held(make_particle({0, 0, 0}, {0, 0, 0}, make_slope(angle, 0.6)), registry,
                         {.integrator = {method}, .dt = 0.01});
    REQUIRE(run(held, 100));
    CHECK(held.position(0).norm() == 0);
    CHECK(held.velocity(0).norm() == 0);
    sim::Simulation slides(make_particle({0, 0, 0}, {0, 0, 0}, make_slope(angle, 0.3)), registry,
                           {.integrator = {method}, .dt = 0.01});
    REQUIRE(run(slides, 100));
    const double a = kGravity * (std::sin(angle) - 0.3 * std::cos(angle));
    const double order = method == std::string("implicit_euler") ? 1e-2 : 1e-6;
    CHECK(slides.velocity(0).norm() == Approx(a).epsilon(order));
    CHECK(slides.position(0).norm() == Approx(0.5 * a).epsilon(2 * order));
  }
}

TEST_CASE("what contact does to energy is in the balance of implicit methods") {
  sim::Registry registry = make_registry();
  sim::PartSpec plane = make_slope(0.5, 0.3);
  plane.given["restitution"] = 0.5;
  sim::Simulation ball(make_particle({0, 1, 0}, {0, 0, 0.2}, plane), registry,
                       {.integrator = {"implicit_midpoint"}, .dt = 0.005});
  sim::study::EnergyBalance balance(ball);
  for (int n = 0; n < 200; ++n) {
    REQUIRE(ball.step());
    balance.advance();
    balance.look();
  }
  CHECK(balance.contact().lost > 1);
  CHECK(std::abs(balance.error()) < 1e-3 * balance.in_play());
}

TEST_CASE("a cloth falls on a sphere in implicit steps, and nothing is inside") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_cloth(12, {.pinned = false});
  const Vec3 center(0.47, -0.3, 0.47);
  spec.colliders = {make_part("sphere", {{"radius", 0.26}, {"center", center}, {"friction", 0.3}})};
  for (const char* method : kImplicit) {
    INFO(method);
    sim::Simulation cloth(spec, registry, {.integrator = {method}, .dt = 0.01});
    sim::Simulation part(spec, registry, {.integrator = {method}, .dt = 0.01});
    double deepest = 0;
    for (int n = 0; n < 80; ++n) {
      REQUIRE(cloth.step());
      deepest = std::max(deepest, depth(cloth, center, 0.26));
      if (n == 40) {  // goes on with the same bits from a snapshot
        REQUIRE(run(part, 20));
        part.restore(cloth.snapshot());
      }
    }
    REQUIRE(run(part, 39));
    CHECK(part.hash() == cloth.hash());
    CHECK(deepest < 1e-12);
    CHECK(cloth.contact_work().lost > 0);
  }
}

TEST_CASE("rounds find the friction of a cloth that slips and sticks on a sphere") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_cloth(12, {.pinned = false});
  spec.colliders = {make_part(
      "sphere", {{"radius", 0.26}, {"center", Vec3(0.47, -0.27, 0.47)}, {"friction", 0.5}})};
  sim::Simulation cloth(spec, registry, {.integrator = {"implicit_midpoint"}, .dt = 0.001});
  REQUIRE(run(cloth, 500));
  CHECK(cloth.contact_work().lost > 0);
  CHECK(cloth.integrator().effort().newton <
        8 * 500);  // rounds that come to no end take twice as many
}

TEST_CASE("a plane that nothing comes near changes no bit of implicit methods") {
  sim::Registry registry = make_registry();
  sim::SystemSpec with = make_cloth(6);
  with.colliders = {make_part("plane", {{"point", Vec3(0, -10, 0)}})};
  for (const char* method : kImplicit) {
    INFO(method);
    sim::Simulation a(with, registry, {.integrator = {method}, .dt = 5e-3});
    sim::Simulation b(make_cloth(6), registry, {.integrator = {method}, .dt = 5e-3});
    REQUIRE((run(a, 20) && run(b, 20)));
    CHECK(a.hash() == b.hash());
  }
}

// The slip of what lies in a gutter falls to 1e-160 m/s from step to step.
TEST_CASE("a particle comes to rest in a rough gutter, and stays there") {
  const double c = std::sqrt(0.5);
  sim::Registry registry = make_registry();
  for (const char* method : kImplicit) {
    INFO(method);
    sim::SystemSpec spec = make_particle(
        {0, 0.5, 0}, {0, 0, 0}, make_part("plane", {{"normal", Vec3(c, c, 0)}, {"friction", 0.3}}));
    spec.colliders.push_back(make_part("plane", {{"normal", Vec3(-c, c, 0)}, {"friction", 0.3}}));
    sim::Simulation system(spec, registry, {.integrator = {method}, .dt = 0.005});
    REQUIRE(run(system, 400));
    CHECK(system.position(0).norm() < 1e-9);
    CHECK(system.velocity(0).norm() < 1e-9);
  }
}
