// Islands that rest take no steps.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/geometry/rigid_motion.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scene/scene_part.h"
#include "core/session/checkpoint.h"
#include "core/study/energy_balance.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Vec3;

namespace {

constexpr double kStep = 0.002;  // s
constexpr int kLength = 5;       // particles of a chain

// Chains of 0.25 kg a particle that hang from pins 1 m apart, at the length at which they rest; of
// the first the lowest particle moves.
sim::SystemSpec make_hall(int chains, double speed = 3) {
  constexpr double kStiffness = 400, kMass = 0.25, kRest = 0.25;
  sim::SystemSpec spec = make_falling(1, 0);
  sim::ParticlesSpec& particles = *spec.particles;
  particles.list.clear();
  sim::PartSpec springs = make_springs("chain", kStiffness);
  springs.given["rest"] = kRest;
  for (int chain = 0; chain < chains; ++chain) {
    double y = 0;
    for (int k = 0; k < kLength; ++k) {
      if (k > 0) y -= kRest + (kLength - k) * kMass * kGravity / kStiffness;
      const int id = static_cast<int>(particles.list.size());
      particles.list.push_back({.position = {1.0 * chain, y, 0}, .mass = kMass});
      if (k > 0) springs.elements.add({id - 1, id});
    }
    particles.pinned.push_back(chain * kLength);
  }
  particles.list[kLength - 1].velocity = {0, 0, speed};
  spec.forces = {make_gravity(), make_drag(0.05), springs};
  spec.sleep = sim::SleepSpec{.energy = 1e-9, .after = 0.1};
  return spec;
}

sim::Simulation make(const sim::SystemSpec& spec, sim::Registry& registry,
                     const char* method = "verlet", int threads = 1) {
  return sim::Simulation(spec, registry, {.integrator = method, .dt = kStep, .threads = threads});
}

int asleep_after(sim::Simulation& system, int steps) {
  REQUIRE(run(system, steps));
  return system.sleep().asleep;
}

// At rest until a moment, then along x.
class Starting final : public sim::RigidMotion {
 public:
  Starting(double start, const Vec3& velocity) : start_(start), velocity_(velocity) {}
  sim::Pose at(double t, const Vec3& center) const override {
    sim::Pose pose;
    pose.center = center + std::max(0.0, t - start_) * velocity_;
    pose.velocity = t > start_ ? velocity_ : Vec3(0, 0, 0);
    return pose;
  }
  double max_speed() const override { return velocity_.norm(); }

 private:
  double start_;
  Vec3 velocity_;
};

std::shared_ptr<const sim::RigidMotion> starting(double start, const Vec3& velocity) {
  return std::make_shared<const Starting>(start, velocity);
}

}  // namespace

TEST_CASE("chains that rest fall asleep, and the one that moves goes on as if it were alone") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_hall(4);
  sim::Simulation hall = make(spec, registry);
  CHECK(hall.sleep().islands == 4);
  CHECK(asleep_after(hall, 50) == 0);  // after = 50 steps
  CHECK(asleep_after(hall, 15) == 3);
  CHECK(hall.sleep().since == Approx(0.115).margin(0.015));
  std::vector<Vec3> then;
  for (int i = 0; i < hall.particles(); ++i) then.push_back(hall.position(i));
  REQUIRE(run(hall, 500));
  CHECK(hall.t() == Approx(565 * kStep));

  const std::vector<int> first{0, 1, 2, 3, 4};
  sim::SystemSpec one = sim::scene_part(spec, first);
  sim::Simulation alone = make(one, registry);
  REQUIRE(run(alone, 565));
  for (int i = 0; i < kLength; ++i) {
    CHECK((hall.position(i) - alone.position(i)).norm() < 1e-12);
    CHECK((hall.velocity(i) - alone.velocity(i)).norm() < 1e-11);
  }
  CHECK((hall.position(4) - then[4]).norm() > 0.01);
  for (int i = kLength; i < 4 * kLength; ++i) {
    CHECK(hall.position(i) == then[static_cast<std::size_t>(i)]);
    CHECK(hall.velocity(i) == Vec3(0, 0, 0));
  }
}

TEST_CASE("a scene in which nothing rests has the bits that it has without sleep") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_hall(1);
  for (const char* const method : {"verlet", "rk4", "dopri5", "trbdf2"}) {
    sim::Simulation with = make(spec, registry, method);
    sim::SystemSpec awake = spec;
    awake.sleep.reset();
    sim::Simulation without = make(awake, registry, method);
    CHECK(asleep_after(with, 200) == 0);
    CHECK(without.sleep().islands == 0);
    REQUIRE(run(without, 200));
    CHECK(same_bits(state_of(with), state_of(without)));
  }
}

TEST_CASE("the energy that falling asleep takes is booked") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_hall(3, 1);
  spec.forces[1] = make_drag(1.0);
  spec.sleep->energy = 1e-4;
  sim::Simulation system = make(spec, registry);
  sim::study::EnergyBalance balance(system);
  for (int n = 0; n < 3000; ++n) {
    REQUIRE(system.step());
    balance.advance();
    balance.look();
  }
  CHECK(system.sleep().asleep == 3);
  CHECK(system.sleep().taken > 1e-6);
  CHECK(system.sleep().taken < 3e-4);
  CHECK(std::fabs(balance.error()) < 2e-2 * system.sleep().taken + 1e-6);
  // Time goes on where all sleep.
  const std::vector<double> then = state_of(system);
  const double t = system.t();
  REQUIRE(run(system, 10));
  CHECK(system.t() == Approx(t + 10 * kStep));
  CHECK(same_bits(state_of(system), then));
}

TEST_CASE("a hand, a pin and a switch wake islands") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_hall(4);
  sim::PartSpec draught = make_part("gravity", {{"g", Vec3(1, 0, 0)}});
  draught.switch_name = "draught";
  draught.on = false;
  spec.forces.push_back(draught);
  sim::Simulation system = make(spec, registry);
  REQUIRE(asleep_after(system, 65) == 3);

  system.set_velocity(2 * kLength - 1, {0.5, 0, 0});
  CHECK(system.sleep().asleep == 2);
  REQUIRE(run(system, 20));
  CHECK(system.position(2 * kLength - 1).x() > 1.005);

  system.set_pinned(2 * kLength, false);
  CHECK(system.sleep().asleep == 1);
  REQUIRE(run(system, 20));
  CHECK(system.position(2 * kLength).y() < -0.001);

  system.set_held(3 * kLength + 2, true);
  CHECK(system.sleep().asleep == 0);
  REQUIRE(asleep_after(system, 65) == 1);  // it holds still
  system.set_velocity(3 * kLength + 2, {0, 0, 1});
  REQUIRE(asleep_after(system, 100) == 0);
  CHECK(system.position(3 * kLength + 2).z() == Approx(0.2));

  sim::Simulation other = make(spec, registry);
  REQUIRE(asleep_after(other, 65) == 3);
  other.set_switch("draught", true);
  CHECK(other.sleep().asleep == 0);
  REQUIRE(run(other, 50));
  CHECK(other.position(2 * kLength - 1).x() > 1.001);
}

TEST_CASE("prescribed motion and colliders that begin to move wake islands") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_hall(3);
  const int led = 2 * kLength;
  std::erase(spec.particles->pinned, led);
  for (const Vec3& velocity : {Vec3(0, 0.2, 0), Vec3(0, 0, -0.2)}) {
    spec.particles->prescribed = {{led, starting(0.6, velocity), {}}};
    sim::Simulation across = make(spec, registry);
    REQUIRE(asleep_after(across, 299) == 2);
    REQUIRE(asleep_after(across, 4) == 1);
  }
  spec.particles->prescribed = {{led, starting(0.6, {0.2, 0, 0}), {}}};
  sim::Simulation system = make(spec, registry);
  REQUIRE(asleep_after(system, 299) == 2);
  REQUIRE(asleep_after(system, 51) == 1);
  CHECK(system.position(led).x() == Approx(2 + 0.02).epsilon(1e-6));
  CHECK(system.position(led + 1).x() > 2.0001);

  // A wall that comes to chain 2 at t = 0.6 + 0.5 / 1.
  sim::SystemSpec walled = make_hall(3);
  walled.colliders = {make_part("plane", {{"normal", Vec3(-1, 0, 0)},
                                          {"point", Vec3(2.5, 0, 0)},
                                          {"motion", starting(0.6, {-1, 0, 0})}})};
  sim::Simulation pushed = make(walled, registry);
  REQUIRE(asleep_after(pushed, 540) == 2);
  REQUIRE(asleep_after(pushed, 60) == 1);
  CHECK(pushed.t() == Approx(1.2));
  for (int i = 2 * kLength + 1; i < 3 * kLength; ++i) CHECK(pushed.position(i).x() <= 1.9 + 1e-9);
}

TEST_CASE("forces that change in time wake islands within the time after which they may sleep") {
  sim::Registry registry = make_registry();
  // A tie whose ends are drawn together from t = 0.6 s on.
  sim::SystemSpec spec = make_hall(3);
  sim::PartSpec pull = make_part("expression", {{"energy", std::string("2*r*max(0, t - 0.6)")}});
  pull.elements.add({2 * kLength, 3 * kLength - 1});
  spec.forces.push_back(pull);
  sim::Simulation system = make(spec, registry);
  REQUIRE(asleep_after(system, 299) == 2);
  REQUIRE(asleep_after(system, 51) == 1);
  const double then = system.position(3 * kLength - 1).y();
  REQUIRE(run(system, 100));
  CHECK(system.position(3 * kLength - 1).y() > then + 1e-4);
}

TEST_CASE("a sheet that falls on a sheet at rest wakes it before they touch") {
  sim::Registry registry = make_registry();
  // Two squares of four particles: one lies pinned at two corners of its own weight, the other
  // falls from above.
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list.clear();
  sim::PartSpec springs = make_springs("edge", 500);
  std::vector<sim::TriangleMesh::Triangle> triangles;
  for (int square = 0; square < 2; ++square) {
    const double y = 0.5 * square, s = square == 0 ? 1 : 0.5, first = 0.5 - 0.5 * s;
    const int id = 4 * square;
    for (const auto& [x, z] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}})
      spec.particles->list.push_back({.position = {first + s * x, y, first + s * z}, .mass = 0.1});
    for (const auto& [a, b] : {std::pair{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}, {1, 3}})
      springs.elements.add({id + a, id + b});
    triangles.push_back({id, id + 2, id + 1});
    triangles.push_back({id, id + 3, id + 2});
  }
  spec.particles->pinned = {0, 1, 2, 3};
  spec.forces = {make_gravity(), make_drag(0.01), springs};
  spec.contact = sim::ContactSpec{{std::make_shared<const sim::TriangleMesh>(8, triangles)},
                                  {{"thickness", 0.02}}};
  spec.sleep = sim::SleepSpec{.energy = 1e-6, .after = 0.05};
  sim::Simulation system = make(spec, registry);
  CHECK(system.sleep().islands == 2);
  REQUIRE(asleep_after(system, 40) == 1);
  bool woken = false;
  for (int n = 0; n < 1500; ++n) {
    REQUIRE(system.step());
    woken = woken || system.sleep().asleep == 0;
    for (int i = 4; i < 8; ++i) REQUIRE(system.position(i).y() > 0.0);
  }
  CHECK(woken);
  CHECK(system.sleep().asleep == 2);  // one on the other
  for (int i = 4; i < 8; ++i) CHECK(system.position(i).y() < 0.05);
}

TEST_CASE("a run of which some sleep goes on from snapshots and checkpoints with the same bits") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_hall(4);
  for (const char* const method : {"verlet", "bdf2", "dopri5"}) {
    for (const int at : {20, 63, 300}) {
      sim::Simulation whole = make(spec, registry, method);
      REQUIRE(run(whole, at));
      sim::Simulation other = make(spec, registry, method);
      sim::resume(other, spec, sim::checkpoint(whole, spec, 0), registry);
      CHECK(other.sleep().asleep == whole.sleep().asleep);
      REQUIRE(run(whole, 200));
      REQUIRE(run(other, 200));
      INFO(method << " at " << at);
      CHECK(same_bits(state_of(whole), state_of(other)));
      CHECK(other.sleep().since == whole.sleep().since);
      CHECK(other.sleep().taken == whole.sleep().taken);
    }
  }
  sim::Simulation system = make(spec, registry);
  REQUIRE(asleep_after(system, 65) == 3);
  system.reset();
  CHECK(system.sleep().asleep == 0);
  CHECK(system.sleep().taken == 0);
}

TEST_CASE("sleep has the same bits whether states between steps are asked for or not") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_hall(4);
  spec.particles->list[kLength - 1].velocity = {0, 0, 0.01};
  spec.forces[1] = make_drag(0.5);
  sim::Simulation each = make(spec, registry), some = make(spec, registry);
  REQUIRE(run(each, 6000));
  for (std::int64_t left = 6000; left > 0;) {
    const int taken = some.steps(std::min<std::int64_t>(left, 37));
    REQUIRE(taken > 0);
    left -= taken;
  }
  CHECK(each.sleep().asleep == 4);
  CHECK(each.sleep().since == some.sleep().since);
  CHECK(same_bits(state_of(each), state_of(some)));
}

TEST_CASE("sleep has the same bits on any number of threads") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_hall(900);
  sim::Simulation one = make(spec, registry, "rk4", 1), three = make(spec, registry, "rk4", 3);
  REQUIRE(asleep_after(one, 80) == 899);
  REQUIRE(asleep_after(three, 80) == 899);
  CHECK(same_bits(state_of(one), state_of(three)));
}

TEST_CASE("sleep without a positive energy or time, or where nothing rests alone, is an error") {
  sim::Registry registry = make_registry();
  const auto refused = [&](const sim::SystemSpec& spec, const std::string& why) {
    CHECK_THROWS_WITH(make(spec, registry),
                      Catch::Contains("sleep does not fit") && Catch::Contains(why));
  };
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, std::nan(""), inf}) {
    sim::SystemSpec spec = make_hall(2);
    spec.sleep->energy = bad;
    refused(spec, "energy");
    spec = make_hall(2);
    spec.sleep->after = bad;
    refused(spec, "after");
  }
  // The shortest and the longest times are no errors: looks at all steps, or at none.
  for (const double after : {1e-300, 1e-12, 1e300}) {
    sim::SystemSpec spec = make_hall(2);
    spec.sleep->after = after;
    sim::Simulation system = make(spec, registry);
    for (int taken = 0; taken < 20;) taken += system.steps(20 - taken);
    CHECK(system.sleep().asleep == (after == 1e-12 ? 1 : 0));
  }
  sim::SystemSpec pairs = make_hall(2);
  pairs.forces.push_back(
      make_part("pair", {{"potential", std::string("soft")}, {"k", 1.0}, {"radius", 0.1}}));
  refused(pairs, "may join any particles");
  sim::SystemSpec breaking = make_hall(2);
  breaking.forces.back().given["break_strain"] = 0.5;
  refused(breaking, "may break");
  sim::SystemSpec windy = make_hall(2);
  windy.forces.push_back(make_part("gust", {{"c", 0.01}}));
  refused(windy, "internal variables");
  // Each part of the error in its place.
  const auto says = [&](sim::SystemSpec spec, const std::string& why) {
    spec.place = "hall.lua:7";
    CHECK_THROWS_WITH(make(spec, registry), "sleep does not fit: hall.lua:7: " + why);
  };
  sim::SystemSpec rods = make_hall(3);
  sim::PartSpec rod = make_part("distance");
  for (int k = 1; k < kLength; ++k) rod.elements.add({kLength + k - 1, kLength + k});
  rods.constraints = {rod};
  CHECK(make(rods, registry).sleep().islands == 3);
  rods.forces = {make_gravity(), make_drag(0.05)};  // each other particle is alone
  CHECK(make(rods, registry).sleep().islands == 1 + 2 * kLength);
  rods.constraints[0].given["break_force"] = 5.0;
  says(rods, "this scene has rods that may break; leave sleep out, or break_force");
  sim::SystemSpec led = make_hall(1);
  led.constraints = {make_part("on_plane", {{"point", starting(0, {0, 0, 1})}})};
  led.constraints[0].elements.arity = 1;
  led.constraints[0].elements.ids = {1};
  says(led, "this scene has constraints that move; leave sleep out");
  sim::SystemSpec first = make_circle();
  first.sleep = sim::SleepSpec{.energy = 1};
  CHECK_THROWS_WITH(sim::Simulation(first, registry), Catch::Contains("first-order"));
}

TEST_CASE("a part of a scene has the elements, pins and numbers of its particles") {
  sim::SystemSpec whole = make_cloth(3);
  sim::PartSpec ties = make_springs("tie", 7);
  ties.elements.values["stiffness"] = {};
  ties.elements.add({9, 10}, {{"stiffness", 3}});
  ties.elements.add({0, 8}, {{"stiffness", 4}});
  whole.forces.push_back(ties);
  whole.particles->list = {{.position = {5, 0, 0}, .mass = 2}, {.position = {6, 0, 0}, .mass = 3}};
  whole.particles->numbers["charge"] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  whole.particles->pinned.push_back(10);
  whole.loads.assign(11, Vec3(0, 0, 0));
  whole.loads[9] = {1, 2, 3};
  whole.surfaces = {};

  const std::vector<int> cloth{0, 1, 2, 3, 4, 5, 6, 7, 8}, pair{9, 10};
  const sim::SystemSpec left = sim::scene_part(whole, pair), rest = sim::scene_part(whole, cloth);
  REQUIRE(left.particles->count() == 2);
  CHECK(left.particles->at(0).position == Vec3(5, 0, 0));
  CHECK(left.particles->at(1).mass == 3);
  CHECK(left.particles->pinned == std::vector<int>{1});
  CHECK(left.particles->numbers.at("charge") == std::vector<double>{9, 10});
  CHECK(left.loads[0] == Vec3(1, 2, 3));
  // The springs between the two alone are left, with their own stiffness.
  const sim::PartSpec& own = left.forces.back();
  CHECK(own.elements.ids == std::vector<int>{0, 1});
  CHECK(own.elements.values.at("stiffness") == std::vector<double>{3});
  CHECK(left.forces.size() + 3 == whole.forces.size());  // without the three families of the cloth

  CHECK(rest.particles->count() == 9);
  CHECK(rest.particles->at(4).position == whole.particles->at(4).position);
  std::size_t grids = 0;
  for (const sim::PartSpec& force : rest.forces) grids += force.elements.grids.size();
  CHECK(grids > 0);
  CHECK(rest.forces.back().elements.ids == std::vector<int>{0, 8});
}
