// The energy that contact takes, or seems to give, in the verdict.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/particles/contact_law.h"
#include "core/study/verdict/verdict.h"
#include "tests/lua/scene_text.h"

using sim::study::Trust;
using sim::study::Verdict;

namespace {

// Bounces with more than the whole velocity, as no law of contact does.
struct Springy final : sim::ContactLaw {
  explicit Springy(double e) : e_(e) {}
  double restitution(double /*approach*/) const override { return e_; }
  double friction(double /*slip*/) const override { return 0; }
  double e_;
};

// A particle of 1 kg falls by 0.5 m and bounces once with e^2 = 1 + surplus. In play are the 4.9 J
// that it falls by and as many that it moves with.
Verdict bounce(double surplus) {
  sim::SystemSpec spec =
      sim::test::load_text(
          "local p = sim.particles { mass = 1 }\n"
          "p:add {0, 0.5, 0}\n"
          "return sim.scene { particles = p, forces = { sim.force.gravity {} },\n"
          "  colliders = { sim.collider.plane { normal = {0, 1, 0} } },\n"
          "  integrator = 'verlet', dt = 0.01, duration = 0.5 }")
          .systems[0];
  spec.colliders[0].given["law"] =
      std::shared_ptr<const sim::ContactLaw>(new Springy(std::sqrt(1 + surplus)));
  sim::Registry registry({SIM_PLUGIN_DIR});
  sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = 0.01});
  sim::study::Monitor monitor(spec, system, 50, &registry);
  for (int i = 0; i < 50; ++i) {
    REQUIRE(system.step());
    monitor.advance();
    const sim::Energy energy = system.energy();
    monitor.look(&energy);
  }
  CHECK(system.contact_work().lost == Approx(-surplus * 9.81 * 0.5).margin(1e-9));
  return monitor.verdict();
}

}  // namespace

TEST_CASE("contact that gives more than a thousandth of the energy in play is not trusted") {
  const std::string gave = "contact, which can only take energy, gave ";
  for (const double surplus : {-0.5, 0.0, 1.8e-3})
    CHECK(bounce(surplus).reason.find(gave) == std::string::npos);
  const Verdict given = bounce(2.2e-3);
  INFO(given.reason);
  CHECK(given.trust == Trust::kSuspect);
  CHECK(given.reason.find(gave + "0.0108 J, 0.11 % of the energy in play") != std::string::npos);
}

// A particle is put inside by hand before a look, as no contact that works leaves one.
TEST_CASE("a particle inside a collider is in the verdict, also if it is outside at the end") {
  const sim::SystemSpec spec =
      sim::test::load_text(
          "local p = sim.particles { mass = 1 }\n"
          "p:add {0, 0, 0}\n"
          "return sim.scene { particles = p, forces = { sim.force.gravity {} },\n"
          "  colliders = { sim.collider.plane { normal = {0, 1, 0} } },\n"
          "  integrator = 'verlet', dt = 0.01, duration = 0.5 }")
          .systems[0];
  sim::Registry registry({SIM_PLUGIN_DIR});
  for (const double depth : {0.0, 1e-7, 1e-3}) {
    sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = 0.01});
    sim::study::Monitor monitor(spec, system, 50, &registry);
    for (int i = 0; i < 50; ++i) {
      REQUIRE(system.step());
      monitor.advance();
      const sim::Vec3 before = system.position(0);
      if (i == 20) system.set_position(0, {0, -depth, 0});
      const sim::Energy energy = system.energy();
      monitor.look(&energy);
      system.set_position(0, before);
    }
    const std::string reason = monitor.verdict().reason;
    INFO(reason);
    CHECK((reason.find("particle 0 was 0.001 m inside a collider") != std::string::npos) ==
          (depth > 1e-5));
  }
}
