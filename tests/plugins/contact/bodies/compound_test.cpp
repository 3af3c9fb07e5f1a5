// Bodies of several shapes, and capsules side by side.
#include <cmath>

#include "core/particles/step_correction.h"
#include "plugins/contact/bodies/collide.h"
#include "plugins/forces/fluid/boundary_sampling.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

RigidShape box_at(const Vec3& half, const Vec3& at, const Vec3& rotation = {0, 0, 0}) {
  RigidShape box{.form = RigidShape::Form::kBox, .half = half};
  box.at = at, box.rotation = rotation;
  return box;
}

std::string scene_of(const std::string& before, const std::string& keys) {
  return before + "\nreturn sim.scene { " + keys +
         ", forces = { sim.force.gravity { g = {0, -9.81, 0} } }, integrator = 'verlet', dt = "
         "0.005, duration = 1 }\n";
}

}  // namespace

TEST_CASE("parts of a compound have the mass, the center and the moments of the whole", "[rigid]") {
  const double pi = std::acos(-1.0);
  // Halves of a box, of which one is said turned over.
  const RigidShape halves = make_compound(
      {box_at({0.5, 0.3, 0.2}, {1, 2.5, 3}), box_at({0.2, 0.3, 0.5}, {2, 2.5, 3}, {0, pi / 2, 0})});
  const MassProperties two = mass_properties(halves),
                       one = mass_properties(box_at({1, 0.3, 0.2}, {}));
  CHECK(two.volume == Approx(one.volume).epsilon(1e-14));
  CHECK((two.center - Vec3(1.5, 2.5, 3)).norm() < 1e-14);
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      CHECK(two.covariance(row, column) == Approx(one.covariance(row, column)).margin(1e-14));
  // A dumbbell of two balls, by Steiner.
  RigidShape ball{.radius = 0.5}, other{.radius = 0.5};
  ball.at = {0, 2, 0}, other.at = {0, -2, 0};
  const MassProperties bell = mass_properties(make_compound({ball, other}));
  CHECK(bell.covariance(1, 1) == Approx(bell.volume * (0.5 * 0.5 / 5 + 4)).epsilon(1e-14));
  CHECK(bell.covariance(0, 0) == Approx(bell.volume * 0.5 * 0.5 / 5).epsilon(1e-14));
  CHECK(radius_about(make_compound({ball, other}), {0, 0, 0}) == Approx(2.5));
}

// Without friction, whose moment depends on how points share the load.
TEST_CASE("a compound falls and slides as the box that its parts fill", "[rigid]") {
  const std::string whole = "sim.box { half = {0.4, 0.1, 0.2} }",
                    parts =
                        "sim.compound { { sim.box { half = {0.2, 0.1, 0.2} }, at = {-0.2, 0, 0} "
                        "}, { sim.box { half = {0.2, 0.2, 0.1} }, at = {0.2, 0, 0}, rotation = "
                        "{0.5 * math.pi, 0, 0} } }";
  for (const std::string ground : {"sim.collider.plane {}",
                                   "sim.collider.box { half = {9, 1, 9}, center = "
                                   "{0, -1, 0} }"}) {
    const auto run = [&](const std::string& shape) {
      TextRun scene(
          scene_of("local b = sim.rigid { shape = " + shape +
                       ", mass = 3, position = {0, 0.5, 0}, rotation = {0.1, 0, 0.2}, velocity = "
                       "{1, 0, 0}, angular_velocity = {0, 1, 0} }\nlocal c = "
                       "sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 1, position = "
                       "{0.3, 0.9, 0} }",
                   "bodies = { b, c }, colliders = { " + ground + " }"),
          "verlet", 0.005);
      scene.run_to(0.6);
      return scene.system.body_state(0);
    };
    const RigidState one = run(whole), two = run(parts);
    CHECK(one.center.y() < 0.2);
    CHECK((one.center - two.center).norm() < 1e-7);
    CHECK((one.axes.column(0) - two.axes.column(0)).norm() < 1e-5);
  }
}

TEST_CASE("a ring of capsules hangs on the rod that runs through it", "[rigid]") {
  // It has eight sides, one of which lies on the rod in the end.
  TextRun scene(
      scene_of("local r, n, parts = 0.5, 8, {}\nfor k = 1, n do local a = 2 * math.pi * k / n\n"
               "parts[k] = { sim.capsule { radius = 0.05, length = 2 * r * math.sin(math.pi / n) "
               "}, at = { r * math.cos(math.pi / n) * math.cos(a), r * math.cos(math.pi / n) * "
               "math.sin(a), 0 }, rotation = {0, 0, a} } end\nlocal ring = sim.rigid { shape = "
               "sim.compound(parts), mass = 1, friction = 0.5, position = {0.05, 0, 0} }",
               "bodies = { ring }, colliders = { sim.collider.capsule { a = {0, 0, -1}, b = {0, 0, "
               "1}, radius = 0.1, friction = 0.5 } }"),
      "verlet", 0.005);
  double highest = -1;
  while (scene.system.t() < 20) {
    REQUIRE(scene.system.step());
    if (scene.system.t() > 15) highest = std::max(highest, scene.system.body_state(0).center.y());
  }
  const double hangs = 0.5 * std::cos(std::acos(-1.0) / 8) - 0.05 - 0.1;
  CHECK(highest == Approx(-hangs).margin(1e-3));
}

TEST_CASE("points of parts that share a corner are told once", "[rigid]") {
  TextRun scene(
      scene_of("local function half(x) return { sim.box { half = {0.5, 0.1, 0.5} }, at = "
               "{x, 0, 0} } end\nlocal b = sim.rigid { shape = sim.compound { half(-0.5), "
               "half(0.5) }, mass = 1, position = {0, 0.1, 0} }",
               "bodies = { b }, colliders = { sim.collider.plane {} }"),
      "verlet", 0.005);
  scene.run_to(0.05);
  REQUIRE(scene.system.corrections().size() == 1);
  CHECK(contains(scene.system.corrections()[0]->account().words, "at up to 6 points"));
}

TEST_CASE("capsules side by side touch at both ends of what they share", "[rigid]") {
  const RigidShape log{.form = RigidShape::Form::kCapsule, .radius = 0.1, .length = 2};
  for (const double turn : {0.0, 1e-4, -1e-4}) {
    Placed below, above;
    below.shape = above.shape = &log;
    above.center = {0.2, 0.5, 0};
    above.axes = {{1, -turn, 0}, {turn, 1, 0}, {0, 0, 1}};
    std::vector<ManifoldPoint> points;
    collide(below, above, 0.01, points);
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const ManifoldPoint& point : points) {
      low = std::min(low, point.x.y()), high = std::max(high, point.x.y());
      CHECK(std::fabs(point.gap) < 2e-4);
    }
    CHECK(low == Approx(-0.5).margin(1e-3));
    CHECK(high == Approx(1).margin(1e-3));
  }
  // Across each other at the nearest points of their axes.
  Placed across, along;
  across.shape = along.shape = &log;
  across.center = {0.3, -0.2, 0.2};
  across.axes = {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}};  // its axis is x
  std::vector<ManifoldPoint> points;
  collide(along, across, 1e-9, points);
  REQUIRE(points.size() == 1);
  CHECK((points[0].x - Vec3(0, -0.2, 0.1)).norm() < 1e-14);
  CHECK((points[0].normal - Vec3(0, 0, -1)).norm() < 1e-14);
}

TEST_CASE("capsules are as far apart as their axes come near, less their radii", "[rigid]") {
  const RigidShape one{.form = RigidShape::Form::kCapsule, .radius = 0.1, .length = 2},
      two{.form = RigidShape::Form::kCapsule, .radius = 0.2, .length = 1.2};
  for (int k = 0; k < 40; ++k) {
    const auto some = [&](double seed) {
      return Vec3(std::sin(seed + 3 * k), std::sin(2 * seed + 5 * k), std::sin(3 * seed + 7 * k));
    };
    Placed a, b;
    a.shape = &one, b.shape = &two;
    a.center = some(1), b.center = 1.5 * some(2);
    a.axes = turned_by(3.0 * some(3)), b.axes = turned_by(3.0 * some(4));
    std::vector<ManifoldPoint> points;
    collide(a, b, HUGE_VAL, points);
    double gap = HUGE_VAL;
    for (const ManifoldPoint& point : points) gap = std::min(gap, point.gap);
    // The distance from a point of one axis to the other is convex.
    const auto distance = [&](double s) {
      const Vec3 d = a.center + s * a.axes.column(1) - b.center;
      return (d - std::clamp(d.dot(b.axes.column(1)), -0.6, 0.6) * b.axes.column(1)).norm();
    };
    double low = -1, high = 1;
    while (high - low > 1e-9) {
      const double third = (high - low) / 3;
      (distance(low + third) < distance(high - third) ? high : low) +=
          distance(low + third) < distance(high - third) ? -third : third;
    }
    INFO(k);
    CHECK(gap == Approx(distance(low) - 0.3).margin(1e-8));
  }
}

TEST_CASE("points of a compound in a fluid lie within no part of it", "[fluid]") {
  RigidShape rod{.form = RigidShape::Form::kCapsule, .radius = 0.3, .length = 2};
  RigidShape across = rod;
  across.rotation = {0, 0, std::acos(-1.0) / 2};
  const RigidShape cross = make_compound({rod, across});
  std::size_t count = 0;
  for (const Vec3& p : sample_boundary(cross, 0.1, 0.1)) {
    const double one = (p - Vec3(0, std::clamp(p[1], -1.0, 1.0), 0)).norm(),
                 two = (p - Vec3(std::clamp(p[0], -1.0, 1.0), 0, 0)).norm();
    CHECK(std::min(one, two) == Approx(0.2).epsilon(1e-9));
    ++count;
  }
  CHECK(count < 2 * sample_boundary(rod, 0.1, 0.1).size() - 20);
  CHECK(surface_area(cross) == Approx(2 * surface_area(rod)));
  CHECK(is_within(cross, {0.9, 0.2, 0}));
  CHECK_FALSE(is_within(cross, {0.9, 0.9, 0}));
}

TEST_CASE("what of a compound lies within its other parts is not drawn", "[rigid]") {
  const RigidShape box = box_at({1, 1, 1}, {}), inner = box_at({0.5, 0.5, 0.5}, {0.2, 0, 0});
  CHECK(make_compound({box}).triangles.size() == 12);
  CHECK(make_compound({box, inner}).triangles.size() == 12);
  CHECK(make_compound({box, box_at({1, 1, 1}, {3, 0, 0})}).triangles.size() == 24);
  // All triangles of a surface look outward: they hold its volume, as far as 16 sides are round.
  RigidShape capsule{.form = RigidShape::Form::kCapsule, .radius = 0.5, .length = 1};
  for (const RigidShape& part : {box, capsule, RigidShape{.radius = 0.7}}) {
    const RigidShape surface = make_compound({part});
    double volume = 0;
    for (const auto& t : surface.triangles) {
      const auto corner = [&](std::size_t k) {
        return surface.points[static_cast<std::size_t>(t[k])];
      };
      volume += corner(0).dot(corner(1).cross(corner(2))) / 6;
    }
    CHECK(volume == Approx(mass_properties(part).volume).epsilon(part.half[0] > 0 ? 1e-14 : 0.07));
  }
}
