// Contact as a force: how deep, of what order, and with which methods.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/particles/collider.h"
#include "core/study/energy_balance.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Vec3;

namespace {

sim::PartSpec make_penalty(sim::Registry& registry, std::map<std::string, sim::Value> given,
                           const std::string& collider = "plane",
                           const std::map<std::string, sim::Value>& of_collider = {}) {
  const auto& plugin = registry.get<sim::Collider>(collider);
  const sim::Params params(plugin.title(), plugin.params, of_collider, {});
  given["collider"] = std::make_shared<const sim::ColliderMaker>(
      sim::ColliderMaker{[&plugin, params] { return plugin.make(params); }, collider});
  return make_part("contact", given);
}

sim::SystemSpec make_dropped(double mass, double height, sim::PartSpec contact) {
  sim::SystemSpec spec = make_falling(mass, 0);
  spec.particles->list[0] = {.position = {0, height, 0}, .mass = mass};
  spec.forces.push_back(std::move(contact));
  return spec;
}

}  // namespace

TEST_CASE("a particle at rest sinks in until stiffness d^power carries its weight") {
  sim::Registry registry = make_registry();
  struct Case {
    double mass, stiffness, power, depth;
  };
  // (m g / k)^(1/p)
  const Case cases[] = {{1, 1e4, 1, 0.000981},
                        {1, 1e4, 1.5, 0.00987292879703856},
                        {1, 1e4, 3, 0.09936261267216437},
                        {0.015625, 1e4, 3, 0.024840653168041092}};
  for (const Case& c : cases) {
    const double slope = c.power * c.stiffness * std::pow(c.depth, c.power - 1);
    const double damping =
        2 * std::sqrt(slope * c.mass) / std::pow(c.depth, c.power);  // critical, about there
    sim::Simulation ball(make_dropped(c.mass, 0,
                                      make_penalty(registry, {{"stiffness", c.stiffness},
                                                              {"power", c.power},
                                                              {"damping", damping}})),
                         registry, {.integrator = {"rk4"}, .dt = 0.1 * std::sqrt(c.mass / slope)});
    REQUIRE(run(ball, 2000));
    CHECK(ball.position(0).y() == Approx(-c.depth).epsilon(1e-9));
  }
}

TEST_CASE("the smoother the contact, the higher the order that a method keeps") {
  sim::Registry registry = make_registry();
  struct Case {
    double power, stiffness, least;
  };
  for (const Case& c :
       {Case{1, 2e3, 1.6}, Case{1.5, 2e4, 2.2}, Case{2, 2e5, 2.7}, Case{3, 2e7, 3.6}}) {
    const sim::SystemSpec spec = make_dropped(
        1, 0.3, make_penalty(registry, {{"stiffness", c.stiffness}, {"power", c.power}}));
    const auto end_of = [&](int steps) {
      sim::Simulation ball(spec, registry, {.integrator = {"rk4"}, .dt = 1.0 / steps});
      REQUIRE(run(ball, steps));
      return ball.position(0).y();
    };
    const double exact = end_of(64000);
    double coarse = 0, fine = 0;  // of several steps, for the place of the touch in a step matters
    for (const int steps : {490, 500, 511}) coarse += std::abs(end_of(steps) - exact);
    for (const int steps : {3920, 4000, 4088}) fine += std::abs(end_of(steps) - exact);
    INFO(c.power << " " << coarse << " " << fine);
    CHECK(std::log2(coarse / fine) / 3 > c.least);
  }
}

TEST_CASE("adaptive and implicit methods take contact as a force, and keep its energy") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec =
      make_dropped(1, 0.3,
                   make_penalty(registry, {{"stiffness", 1e6}, {"power", 3.0}}, "sphere",
                                {{"radius", 1.0}, {"center", Vec3(0, -1, 0)}}));
  for (const char* method : {"dopri5", "tsit5", "dop853", "implicit_midpoint"}) {
    INFO(method);
    sim::Simulation ball(spec, registry, {.integrator = {method}, .dt = 2e-4});
    sim::study::EnergyBalance balance(ball);
    double highest = 0;
    for (int n = 0; n < 5000; ++n) {
      REQUIRE(ball.step());
      balance.advance();
      balance.look();
      if (ball.t() > 0.4) highest = std::max(highest, ball.position(0).y());
    }
    CHECK(balance.complete());
    CHECK(std::abs(balance.error()) < 1e-4 * balance.in_play());
    CHECK(highest == Approx(0.3).epsilon(1e-4));
  }
}

TEST_CASE("friction of a penalty brakes with mu N, and particles can be left out") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec =
      make_dropped(1, -std::cbrt(kGravity / 1e6),
                   make_penalty(registry, {{"stiffness", 1e6}, {"friction", 0.3}, {"slip", 1e-6}}));
  spec.particles->list[0].velocity = {2, 0, 0};
  spec.particles->list.push_back({.position = {1, -0.5, 0}, .mass = 1});
  spec.forces.back().particles = std::vector<int>{0};
  sim::Simulation slide(spec, registry, {.integrator = {"rk4"}, .dt = 1e-3});
  REQUIRE(run(slide, 500));
  CHECK(slide.velocity(0).x() == Approx(2 - 0.3 * kGravity * 0.5).epsilon(1e-6));
  CHECK(slide.velocity(1).y() == Approx(-0.5 * kGravity));
}
