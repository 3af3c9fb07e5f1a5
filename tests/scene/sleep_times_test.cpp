// When islands fall asleep and wake, where the moment has a closed form.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/geometry/triangle_mesh.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Vec3;

namespace {

constexpr double kStep = 0.002;      // s
constexpr double kThickness = 0.02;  // m, of contact
constexpr double kEnergy = 1e-9;     // J, below which what moves rests
const Vec3 kSize(0.4, 0.3, 0.5);     // m, of the box around a triangle

// Triangles, each an island of three particles of 0.1 kg, that may touch.
struct Triangles {
  sim::SystemSpec spec = make_falling(1, 0);
  sim::PartSpec springs = make_springs("edge", 500);
  std::vector<sim::TriangleMesh::Triangle> mesh;

  Triangles() {
    spec.particles->list.clear();
    spec.forces.clear();
    spec.sleep = sim::SleepSpec{.energy = kEnergy, .after = 0.05};
  }
  void add(const Vec3& low, const Vec3& velocity = {}) {
    const int id = static_cast<int>(spec.particles->list.size());
    const Vec3 corners[3] = {{0, 0, kSize[2]}, {kSize[0], 0, 0}, {0, kSize[1], 0}};
    for (const Vec3& corner : corners)
      spec.particles->list.push_back({.position = low + corner, .velocity = velocity, .mass = 0.1});
    for (int k = 0; k < 3; ++k) springs.elements.add({id + k, id + (k + 1) % 3});
    mesh.push_back({id, id + 1, id + 2});
  }
  sim::Simulation made(sim::Registry& registry) {
    spec.forces = {springs};
    const int n = static_cast<int>(spec.particles->list.size());
    spec.contact = sim::ContactSpec{{std::make_shared<const sim::TriangleMesh>(n, mesh)},
                                    {{"thickness", kThickness}}};
    return sim::Simulation(spec, registry, {.integrator = "verlet", .dt = kStep});
  }
};

Vec3 along(int axis, double by) {
  Vec3 v(0, 0, 0);
  v[static_cast<std::size_t>(axis)] = by;
  return v;
}

}  // namespace

// The kinetic energy K sin^2(omega t) is below K / 2 for a quarter of a period at a time, the first
// whole one from 3/8 T on.
TEST_CASE("what rests for too short a time does not fall asleep, however often it does") {
  sim::Registry registry = make_registry();
  constexpr double kPeriod = 0.5, kAmplitude = 0.1;
  const double omega = 2 * std::numbers::pi / kPeriod;
  for (const double share : {0.26, 0.2}) {
    sim::SystemSpec spec = make_falling(1, 0);
    spec.particles->list = {{.position = {0, 0, 0}}, {.position = {1 + kAmplitude, 0, 0}}};
    spec.particles->pinned = {0};
    sim::PartSpec spring = make_springs("one", omega * omega);
    spring.given["rest"] = 1.0;
    spring.elements.add({0, 1});
    spec.forces = {spring};
    spec.sleep =
        sim::SleepSpec{.energy = 0.25 * std::pow(kAmplitude * omega, 2), .after = share * kPeriod};
    sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = kStep});
    CHECK(system.sleep().islands == 1);
    for (int n = 0; n < 5000 && system.sleep().asleep == 0; ++n) REQUIRE(system.step());
    INFO(share << " of a period");
    CHECK(system.sleep().asleep == (share < 0.25 ? 1 : 0));
    if (share < 0.25) {
      CHECK(system.sleep().since > (0.375 + share) * kPeriod);
      CHECK(system.sleep().since < (0.375 + share) * kPeriod * 1.05);
    }
  }
}

// The boxes around two triangles are D - v t apart. The sleeping one wakes before the step in which
// that may become twice the thickness within two steps; where they pass further apart, it does not.
TEST_CASE("an island wakes when what moves may be within contact of it two steps later") {
  sim::Registry registry = make_registry();
  constexpr double kApart = 0.3, kSpeed = 1.5;
  const double steps = (kApart - 2 * kThickness) / (kSpeed * kStep) - 2;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0})
      for (const double beside : {0.0, 1.9, 2.1}) {
        const int other = (axis + 1) % 3;
        Triangles triangles;
        triangles.add({0, 0, 0});
        const double far = side * (kSize[static_cast<std::size_t>(axis)] + kApart);
        const double off =
            beside == 0 ? 0 : kSize[static_cast<std::size_t>(other)] + beside * kThickness;
        triangles.add(along(axis, far) + along(other, side * off), along(axis, -side * kSpeed));
        sim::Simulation system = triangles.made(registry);
        REQUIRE(system.sleep().islands == 2);
        int asleep = 0;  // steps until the first wakes again
        bool slept = false;
        for (int n = 0; n < 400; ++n) {
          REQUIRE(system.step());
          slept = slept || system.sleep().asleep == 1;
          if (slept && system.sleep().asleep == 0) break;
          asleep = n + 1;
        }
        INFO("axis " << axis << ", side " << side << ", beside " << beside);
        CHECK(slept);
        CHECK(asleep == (beside < 2 ? static_cast<int>(std::ceil(steps)) : 400));
      }
}

// Two beside each other and a third far away, in any order; one moves, too slowly to get anywhere.
TEST_CASE("islands within contact of each other rest together or not at all") {
  sim::Registry registry = make_registry();
  for (int axis = 0; axis < 3; ++axis)
    for (const double apart : {1.9, 2.1})
      for (const int choice : {0, 1, 2, 3, 4, 5, 6, 7, 8}) {
        const int mover = choice % 3, first = choice / 3;
        Triangles triangles;
        const Vec3 places[3] = {
            {0, 0, 0},
            along(axis, kSize[static_cast<std::size_t>(axis)] + apart * kThickness),
            along(axis, 5)};
        for (int i = 0; i < 3; ++i) {
          const int k = (first + i) % 3;
          triangles.add(places[k], k == mover ? Vec3(1e-3, 1e-3, 1e-3) : Vec3(0, 0, 0));
        }
        sim::Simulation system = triangles.made(registry);
        int most = 0;
        for (int n = 0; n < 100; ++n) {
          REQUIRE(system.step());
          most = std::max(most, system.sleep().asleep);
        }
        INFO("axis " << axis << ", apart " << apart << ", mover " << mover);
        CHECK(most == (mover < 2 && apart < 2 ? 1 : 2));
        CHECK(system.sleep().asleep == most);
      }
}

// The wall is at x = 4 - v t from t = 0 on; a particle at x has a gap of 4 - v t - x.
TEST_CASE("an island wakes in the step in which a moving wall reaches it") {
  struct Moving final : sim::RigidMotion {
    sim::Pose at(double t, const Vec3& center) const override {
      sim::Pose pose;
      pose.center = center - Vec3(2 * t, 0, 0);
      pose.velocity = {-2, 0, 0};
      return pose;
    }
    double max_speed() const override { return 2; }
  };
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_falling(1, 0);
  spec.forces.clear();
  spec.particles->list.clear();
  const double places[] = {0.0, 1.0, 2.0, 3.0};
  for (const double x : places) spec.particles->list.push_back({.position = {x, x, 0}});
  spec.colliders = {make_part("plane", {{"normal", Vec3(-1, 0, 0)},
                                        {"point", Vec3(4.002, 0, 0)},
                                        {"motion", std::make_shared<const Moving>()}})};
  spec.sleep = sim::SleepSpec{.energy = kEnergy, .after = 0.1};
  sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = kStep});
  REQUIRE(run(system, 100));
  REQUIRE(system.sleep().asleep == 4);
  std::vector<int> woken;
  for (int n = 101; n < 1100; ++n) {
    const int before = system.sleep().asleep;
    REQUIRE(system.step());
    if (system.sleep().asleep < before) woken.push_back(n);
  }
  std::vector<int> right;
  for (const double x : {3.0, 2.0, 1.0, 0.0})
    right.push_back(static_cast<int>(std::ceil((4.002 - x) / (2 * kStep))));
  CHECK(woken == right);
}

// A particle on a floor has the acceleration of its weight, held by the floor. A force c that comes
// at t = 0.6 s would give it c^2 after^2 / (2 m) by the time after which it may sleep again.
TEST_CASE("a force that changes wakes what it would give more than the energy of rest") {
  sim::Registry registry = make_registry();
  constexpr double kAfter = 0.1, kMass = 0.25;
  const double limit = std::sqrt(2 * kMass * kEnergy) / kAfter;
  for (const double share : {0.98, 1.02}) {
    sim::SystemSpec spec = make_falling(1, 0);
    spec.particles->list = {{.position = {2, 0, 0}}, {.position = {0, 0, 0}, .mass = kMass}};
    spec.particles->pinned = {0};
    sim::PartSpec pull = make_part(
        "expression",
        {{"energy", std::to_string(1e6 * share * limit) + "e-6*r*min(1, max(0, 1e4*(t - 0.6)))"}});
    pull.elements.add({0, 1});
    spec.forces = {make_gravity(), pull};
    spec.colliders = {make_part("plane", {{"normal", Vec3(0, 1, 0)}})};
    spec.sleep = sim::SleepSpec{.energy = kEnergy, .after = kAfter};
    sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = kStep});
    INFO(share << " of the limit");
    REQUIRE(run(system, 299));
    CHECK(system.sleep().asleep == 1);
    int asleep = 299;
    while (system.sleep().asleep == 1 && asleep < 600) {
      REQUIRE(system.step());
      asleep += system.sleep().asleep;
    }
    if (share > 1)
      CHECK(asleep < 300 + static_cast<int>(1.1 * kAfter / kStep));
    else
      CHECK(asleep == 600);
  }
}
