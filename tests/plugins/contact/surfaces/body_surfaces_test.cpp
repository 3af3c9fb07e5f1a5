// Rigid bodies and surfaces do not cross, and push each other as bodies do.
#include <cmath>
#include <sstream>

#include "core/geometry/triangle_mesh.h"
#include "plugins/contact/surfaces/time_of_impact.h"
#include "tests/lua/scene_text.h"
#include "tests/support/all_intersections.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

// A cloth of 8 x 8 particles, 1 m wide, that is held by its corners, and a body above it.
struct Thrown {
  std::string shape;
  double speed = 0;  // m/s, downwards
  double mass = 0.3;
};

std::string text_of(const Thrown& of) {
  std::ostringstream text;
  text << "local g = sim.grid { 8, 8, origin = {-0.5, 0, -0.5}, du = {1/7, 0, 0},\n"
          "  dv = {0, 0, 1/7}, mass = 0.005 }\n"
          "g:pin(g:id(0, 0), g:id(0, 7), g:id(7, 0), g:id(7, 7))\n"
          "local function springs(k, offsets)\n"
          "  return sim.force.spring { stiffness = k, damping = 0.02, grid = g, offsets = offsets "
          "}\n"
          "end\n"
          "local body = sim.rigid { shape = "
       << of.shape << ", mass = " << of.mass << ", friction = 0.4, position = {0.04, 0.15, 0.03},\n"
       << "  rotation = {0.6, 0.4, 0.7}, velocity = {0, " << -of.speed
       << ", 0}, angular_velocity = {2, 1, 3} }\n"
       << "return sim.scene { particles = g, bodies = { body }, integrator = 'verlet',\n"
          "  dt = 0.0004, duration = 1,\n"
          "  contact = sim.contact { surfaces = { sim.surface { grid = g } }, thickness = 0.01 },\n"
          "  forces = { sim.force.gravity {}, springs(300, {{0,1}, {1,0}}),\n"
          "    springs(150, {{1,1}, {1,-1}}) } }\n";
  return text.str();
}

const char* const kCube = "sim.box { half = {0.03, 0.03, 0.03} }";
const char* const kNeedle = "sim.box { half = {0.004, 0.1, 0.004} }";
const char* const kPyramid =
    "sim.mesh { points = { {0.06, 0, 0}, {-0.03, 0, 0.05}, {-0.03, 0, -0.05}, {0, 0.1, 0} },\n"
    "  triangles = { {0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0} } }";
const char* const kBowl =  // which is not convex
    "sim.mesh { points = { {0.08, 0, 0}, {0, 0, 0.08}, {-0.08, 0, 0}, {0, 0, -0.08}, {0, 0.06, "
    "0},\n"
    "    {0, 0.03, 0} },\n"
    "  triangles = { {1, 0, 4}, {2, 1, 4}, {3, 2, 4}, {0, 3, 4}, {0, 1, 5}, {1, 2, 5}, {2, 3, 5},\n"
    "    {3, 0, 5} } }";
const char* const kBall = "sim.sphere { radius = 0.02 }";
const char* const kRod = "sim.capsule { radius = 0.006, length = 0.15 }";
const char* const kHammer =
    "sim.compound { { sim.capsule { radius = 0.005, length = 0.12 } },\n"
    "  { sim.box { half = {0.03, 0.01, 0.01} }, at = {0, 0.06, 0}, rotation = {0, 0.5, 0} } }";

// The least distance, m, between the axes of round parts and the surfaces, less their radius; and
// the number of edges of one that cross a triangle of the other.
struct Found {
  double nearest = HUGE_VAL;
  std::int64_t crossings = 0;
};

Found look(const Simulation& system, const SystemSpec& spec) {
  Found found;
  std::vector<Vec3> places;
  for (int i = 0; i < system.particles(); ++i) places.push_back(system.position(i));
  const auto& cloth = spec.contact->surfaces[0]->triangles();
  std::vector<std::array<int, 3>> triangles(cloth.begin(), cloth.end());
  const RigidState state = system.body_state(0);
  const RigidBody body(spec.bodies[0].shape, spec.bodies[0].mass, 0);
  each_part(*spec.bodies[0].shape, [&](const RigidShape& part, const Vec3& at, const Mat3& axes) {
    if (part.is_round()) {
      for (int k = 0; k <= 60; ++k) {
        const Vec3 on(0, part.length * (k / 60.0 - 0.5), 0);
        for (const auto& t : cloth) {
          const FourPoints p{body.place(state, at + axes * on), system.position(t[0]),
                             system.position(t[1]), system.position(t[2])};
          found.nearest = std::min(found.nearest,
                                   separation_of(PairKind::kVertexTriangle, p).gap - part.radius);
        }
      }
      return;
    }
    const RigidShape mesh = mesh_of(part);
    const int first = static_cast<int>(places.size());
    for (const Vec3& x : mesh.points) places.push_back(body.place(state, at + axes * x));
    for (const auto& t : mesh.triangles)
      triangles.push_back({first + t[0], first + t[1], first + t[2]});
  });
  found.crossings = sim_test::all_crossings(places, triangles);
  return found;
}

// True if a line from the center of the body downwards crosses the cloth an odd number of times.
bool above(const Simulation& system, const SystemSpec& spec) {
  const Vec3 from = system.body_state(0).center;
  int count = 0;
  for (const auto& t : spec.contact->surfaces[0]->triangles()) {
    const Vec3 a = system.position(t[0]) - from, b = system.position(t[1]) - from,
               c = system.position(t[2]) - from;
    const auto side = [](const Vec3& p, const Vec3& q) { return p.x() * q.z() - p.z() * q.x(); };
    const double u = side(b, c), v = side(c, a), w = side(a, b), all = u + v + w;
    if (u * all < 0 || v * all < 0 || w * all < 0) continue;
    const bool below = (u * a.y() + v * b.y() + w * c.y()) / all < 0;
    count += below;
  }
  return count % 2 == 1;
}

}  // namespace

TEST_CASE("bodies with corners, edges and tips do not cross a cloth that catches them") {
  Registry registry({SIM_PLUGIN_DIR});
  int touched = 0;
  for (const char* const shape : {kCube, kNeedle, kPyramid, kBowl, kBall, kRod, kHammer})
    for (const double speed : {0.0, 40.0})
      for (const double mass : {0.01, 3.0}) {
        INFO(shape << ", " << speed << " m/s, " << mass << " kg");
        const SystemSpec spec = load_text(text_of({shape, speed, mass})).systems[0];
        Simulation system(spec, registry);
        const double start = system.body_state(0).velocity.y();
        for (int step = 0; step < 600; ++step) {
          if (!system.step()) FAIL(system.divergence().why);
          if (step % 6 > 0) continue;
          const Found found = look(system, spec);
          REQUIRE(found.crossings == 0);
          REQUIRE(found.nearest > 0);
          const Vec3 center = system.body_state(0).center;
          if (std::max(std::abs(center.x()), std::abs(center.z())) > 0.35) break;
          REQUIRE(above(system, spec));
        }
        touched += system.body_state(0).velocity.y() > start + 0.1;
      }
  CHECK(touched > 12);
}

namespace {

// A body on a sheet between four pinned particles, y = 0, which it touches with the thickness of
// contact, 0.01 m, between them.
std::string on_sheet(const std::string& shape, double height, const std::string& more, double h) {
  std::ostringstream text;
  text << "local g = sim.particles { mass = 1 }\n"
          "for i = 0, 3 do g:add { 6 * (i % 2) - 1, 0, 2 * (i // 2) - 1 } g:pin(i) end\n"
          "local skin = sim.surface { particles = g, triangles = { {0, 2, 1}, {1, 2, 3} } }\n"
          "local body = sim.rigid { shape = "
       << shape << ", mass = 2, position = {0, " << height + 0.01 << ", 0}, " << more
       << " }\n"
          "return sim.scene { particles = g, bodies = { body }, integrator = 'verlet', dt = "
       << h
       << ", duration = 1,\n"
          "  contact = sim.contact { surfaces = { skin }, thickness = 0.01 },\n"
          "  forces = { sim.force.gravity { g = {3, -9, 0} } } }\n";
  return text.str();
}

RigidState after(const std::string& text, double end) {
  Registry registry({SIM_PLUGIN_DIR});
  Simulation system(load_text(text).systems[0], registry);
  while (system.t() < end - 1e-9)
    if (!system.step()) FAIL(system.divergence().why);
  return system.body_state(0);
}

}  // namespace

// A ball of moment 2/5 m r^2 has the acceleration 5/7 g, a barrel that of its own moment.
TEST_CASE("a ball and a barrel roll on a surface, and a box slides on it, as closed forms say") {
  for (const double h : {0.008, 0.002, 0.0005}) {
    INFO(h);
    const RigidState ball =
        after(on_sheet("sim.sphere { radius = 0.1 }", 0.1, "friction = 0.9", h), 0.8);
    CHECK(ball.center.x() == Approx(0.5 * 5.0 / 7 * 3 * 0.64).epsilon(0.2 * h));
    CHECK(ball.center.y() == Approx(0.11).epsilon(1e-3));
    CHECK(ball.angular_velocity.z() == Approx(-5.0 / 7 * 3 * 0.8 / 0.1).epsilon(0.2 * h));
    const RigidState barrel = after(on_sheet("sim.capsule { radius = 0.1, length = 0.3 }", 0.1,
                                             "friction = 0.9, rotation = {math.pi / 2, 0, 0}", h),
                                    0.8);
    RigidShape capsule{.form = RigidShape::Form::kCapsule, .radius = 0.1, .length = 0.3};
    const RigidBody body(std::make_shared<const RigidShape>(capsule), 2, 0);
    const Vec3 moments = body.moments();
    const double share = 1 / (1 + std::min({moments[0], moments[1], moments[2]}) / (2 * 0.01));
    CHECK(barrel.center.x() == Approx(0.5 * share * 3 * 0.64).epsilon(0.2 * h));
    const RigidState box =
        after(on_sheet("sim.box { half = {0.1, 0.1, 0.1} }", 0.1, "friction = 0.2", h), 0.8);
    CHECK(box.center.x() == Approx(0.5 * (3 - 0.2 * 9) * 0.64).epsilon(1e-5));
    CHECK(box.angular_velocity.norm() < 1e-3);
    const RigidState held =
        after(on_sheet("sim.box { half = {0.1, 0.1, 0.1} }", 0.1, "friction = 0.4", h), 0.8);
    CHECK(std::abs(held.center.x()) < 1e-4);
  }
}

TEST_CASE("a body that hits a free cloth keeps the momentum of both") {
  Registry registry({SIM_PLUGIN_DIR});
  for (const char* const shape : {kCube, kBall, kHammer}) {
    std::string text = text_of({shape, 10, 0.2});
    text.erase(text.find("g:pin"), text.find('\n', text.find("g:pin")) - text.find("g:pin"));
    text.erase(text.find("sim.force.gravity {}, "), 22);
    const SystemSpec spec = load_text(text).systems[0];
    Simulation system(spec, registry);
    const auto momentum = [&] {
      Vec3 sum = 0.2 * system.body_state(0).velocity;
      for (int i = 0; i < 64; ++i) sum += 0.005 * system.velocity(i);
      return sum;
    };
    const Vec3 before = momentum();
    for (int step = 0; step < 200; ++step)
      if (!system.step()) FAIL(system.divergence().why);
    CHECK(system.body_state(0).velocity.y() > -9);
    CHECK((momentum() - before).norm() < 1e-12);
  }
}

TEST_CASE("bodies that cross or touch surfaces at the start are refused, unless tied to them") {
  const auto refused = [](const std::string& shape, double height) {
    const auto error = text_error(on_sheet(shape, height - 0.01, "friction = 0", 0.01));
    return error ? std::string(error->what()) : "";
  };
  CHECK(refused("sim.box { half = {0.1, 0.1, 0.1} }", 0.2).empty());
  CHECK(contains(refused("sim.box { half = {0.1, 0.1, 0.1} }", 0.05), "and body 0 cross"));
  CHECK(contains(refused("sim.box { half = {0.1, 0.1, 0.1} }", 0.1), "body 0"));
  CHECK(contains(refused("sim.sphere { radius = 0.1 }", 0.05), "body 0 and triangle"));
  CHECK(contains(refused("sim.capsule { radius = 0.1, length = 1 }", 0.5), "body 0"));
  CHECK(refused("sim.capsule { radius = 0.1, length = 1 }", 0.601).empty());
  for (const auto& [shape, height] : {std::pair{"sim.sphere { radius = 0.1 }", 0.05},
                                      {"sim.sphere { radius = 0.1 }", 0.3},
                                      {"sim.box { half = {0.1, 0.1, 0.1} }", 0.05}}) {
    std::string text = on_sheet(shape, height, "friction = 0", 0.01);
    text.insert(text.find("return"),
                "local tie = sim.force.spring { stiffness = 1 }\n"
                "tie:tie(body:at {0, 0, 0}, 1)\n");
    text.insert(text.find("sim.force.gravity"), "tie, ");
    CHECK(after(text, 0.5).center.y() < -0.1);
  }
}

TEST_CASE("a body does not bounce on a surface, whose particles are the surface's alone") {
  const std::string box = "sim.box { half = {0.1, 0.1, 0.1} }";
  for (const double speed : {0.0, 12.0}) {
    const std::string more = "position = {-0.98, 0.26, -0.97}, restitution = 0.9, velocity = {0, " +
                             std::to_string(-speed) + ", 0}";
    const RigidState end = after(on_sheet(box, 0, more, 0.002), 0.25);
    CHECK(std::abs(end.velocity.y()) < 0.02);
    CHECK(end.center.y() > 0.1);
  }
}
