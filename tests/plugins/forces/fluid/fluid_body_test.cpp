// Rigid bodies in fluids: Archimedes, momentum and energy, and what the fluid says it does not see.
#include <cmath>

#include "plugins/forces/fluid/boundary_sampling.h"
#include "tests/lua/scene_text.h"
#include "tests/support/momentum.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;
using Catch::Contains;
using sim_test::Momentum;
using sim_test::momentum_of;

namespace {

// Water 5 cm apart in a basin of 40 cm, 30 cm deep, and above it a box of 20 cm.
std::string basin(const std::string& body, const std::string& more = "bodies = { body }") {
  return R"(
local a, water = 0.05, sim.particles { mass = 1000 * 0.05^3 }
local told = 0
local function off() told = told + 1; return 0.004 * a * ((told * 0.618034) % 1 - 0.5) end
for i = 1, 8 do for j = 1, 6 do for k = 1, 8 do
  water:add { (i - 0.5) * a + off(), (j - 0.5) * a + off(), (k - 0.5) * a + off() }
end end end
local walls = sim.collider.box { center = {0.2, 1, 0.2}, half = {0.2, 1, 0.2}, inside = true,
  thickness = a / 4 }
local body = sim.rigid { )" +
         body + R"( }
return sim.scene { particles = water, bodies = { body }, colliders = { walls },
  forces = { sim.force.gravity {}, sim.force.fluid { speed_of_sound = 30, alpha = 0.4,
    boundary = { walls }, )" +
         more + R"( } },
  integrator = 'verlet', dt = 0.0005, duration = 1 })";
}

const std::string kBox = "shape = sim.box { half = {0.1, 0.1, 0.1} }, position = {0.2, 0.4, 0.2}";

// m, of the box, in the mean over the last 0.6 s of 1.6.
double height(const std::string& density) {
  TextRun run(basin(kBox + ", density = " + density), "verlet", 0.0005);
  run.run_to(1);
  double sum = 0;
  int looks = 0;
  for (; run.system.t() < 1.6; ++looks) {
    REQUIRE(run.system.step());
    sum += run.system.body_state(0).center.y();
  }
  return sum / looks;
}

// Water about a body that turns, closing in on it; nothing held and no weight.
std::string lump(const std::string& shape, bool touches) {
  return R"(
local a, water, told = 0.05, sim.particles { mass = 1000 * 0.05^3 }, 0
local function off() told = told + 1; return 0.1 * a * ((told * 0.618034) % 1 - 0.5) end
for i = -4, 4 do for j = -4, 4 do for k = -4, 4 do
  local x, y, z = i * a, j * a, k * a
  if math.max(math.abs(x), math.abs(y), math.abs(z)) > 2.6 * a then
    water:add({ x + off(), y + off(), z + off() },
      { velocity = { -2 * x + y, -2 * y - x, -2 * z } })
  end
end end end
local body = sim.rigid { shape = )" +
         shape + ", density = 400, spin = {0, 0, 2}, velocity = {0.3, 0, 0}, touches = " +
         (touches ? "true" : "false") + R"( }
return sim.scene { particles = water, bodies = { body }, forces = { sim.force.fluid {
  speed_of_sound = 20, alpha = 0, viscosity = 0, bodies = body } },
  integrator = 'verlet', dt = 0.0005, duration = 1 })";
}

const char* const kTetrahedron =
    "sim.mesh { points = { {0.3,0.3,0.3}, {0.3,-0.3,-0.3}, {-0.3,0.3,-0.3}, {-0.3,-0.3,0.3} }, "
    "triangles = { {0,1,2}, {0,2,3}, {0,3,1}, {1,3,2} } }";

std::vector<std::string> notes_of(const std::string& text) {
  TextRun run(text, "verlet", 0.0005);
  return run.system.ode().notes();
}

double distance_to_box(const Vec3& p, const Vec3& half) {
  double least = HUGE_VAL;
  for (std::size_t axis = 0; axis < 3; ++axis)
    least = std::min(least, half[axis] - std::fabs(p[axis]));
  return least;
}

}  // namespace

TEST_CASE("a body floats as Archimedes says, and a heavy one sinks", "[scene][fluid]") {
  // A box of d times the density of water has the share d of its height below the level, which it
  // lifts.
  const auto expected = [](double d) { return 0.3 + d * 0.2 * 0.04 / 0.16 + 0.1 - 0.2 * d; };
  CHECK(height("500") == Approx(expected(0.5)).margin(0.005));
  CHECK(height("700") == Approx(expected(0.7)).margin(0.006));
  CHECK(height("3000") < 0.15);
}

TEST_CASE("a fluid and bodies keep momentum, turning momentum and energy", "[scene][fluid]") {
  for (const std::string& shape : {std::string("sim.box { half = {0.11, 0.1, 0.09} }"),
                                   std::string("sim.sphere { radius = 0.12 }"),
                                   std::string("sim.capsule { radius = 0.08, length = 0.08 }")})
    for (const bool touches : {false, true})
      for (const std::string method : {"verlet", "rk4", "symplectic_euler"}) {
        if (touches && method != "verlet") continue;
        TextRun run(lump(shape, touches), method, 0.0005);
        const double mass = 1000 * std::pow(0.05, 3);
        const Momentum before = momentum_of(run.system, mass);
        const double energy = run.system.energy().total();
        const Vec3 speed = run.system.body_state(0).velocity;
        double pushed = 0;
        for (int step = 0; step < 250; ++step) {
          REQUIRE(run.system.step());
          pushed = std::max(pushed, (run.system.body_state(0).velocity - speed).norm());
        }
        const Momentum after = momentum_of(run.system, mass);
        INFO(shape << " " << method << ", pushed " << pushed);
        CHECK(pushed > 0.02);
        CHECK((after.linear - before.linear).norm() < 1e-12);
        // rk4 keeps it to its order, and contact with single particles less.
        const double most = touches ? 1e-4 : method == "rk4" ? 1e-8 : 1e-12;
        CHECK((after.angular - before.angular).norm() < most);
        if (!touches)
          CHECK(std::fabs(run.system.energy().total() - energy) <
                (method == "symplectic_euler" ? 0.05 : 0.005) * energy);
      }
  // The same bits on threads.
  TextRun one(lump("sim.sphere { radius = 0.12 }", true), "verlet", 0.0005),
      two(lump("sim.sphere { radius = 0.12 }", true), "verlet", 0.0005, 2);
  for (int step = 0; step < 50; ++step) REQUIRE((one.system.step() && two.system.step()));
  CHECK(one.system.hash() == two.system.hash());
}

TEST_CASE("points of a body lie under its surface, as deep and as wide as asked", "[fluid]") {
  const double depth = 0.1, width = 0.12;
  const Vec3 half(0.5, 0.3, 0.2);
  const RigidShape box{.form = RigidShape::Form::kBox, .half = half};
  const RigidShape capsule{.form = RigidShape::Form::kCapsule, .radius = 0.4, .length = 0.7};
  RigidShape mesh{.form = RigidShape::Form::kMesh};
  for (int corner = 0; corner < 8; ++corner)
    mesh.points.push_back({corner & 1 ? half[0] : -half[0], corner & 2 ? half[1] : -half[1],
                           corner & 4 ? half[2] : -half[2]});
  for (const std::array<int, 4>& face : std::initializer_list<std::array<int, 4>>{
           {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}) {
    mesh.triangles.push_back({face[0], face[1], face[2]});
    mesh.triangles.push_back({face[0], face[2], face[3]});
  }
  REQUIRE(mass_properties(mesh).volume == Approx(8 * half[0] * half[1] * half[2]));
  for (const RigidShape& shape : {box, mesh}) {
    const std::vector<Vec3> points = sample_boundary(shape, depth, width);
    for (const Vec3& p : points) CHECK(distance_to_box(p, half) == Approx(depth).epsilon(0.03));
    // No place of the inner surface is far from all of them.
    const Vec3 inner = half - Vec3::Constant(depth);
    for (double u = -1; u <= 1; u += 0.1)
      for (double v = -1; v <= 1; v += 0.1)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          Vec3 at;
          at[axis] = inner[axis];
          at[(axis + 1) % 3] = u * inner[(axis + 1) % 3];
          at[(axis + 2) % 3] = v * inner[(axis + 2) % 3];
          double nearest = HUGE_VAL;
          for (const Vec3& p : points) nearest = std::min(nearest, (p - at).norm());
          CHECK(nearest < 0.75 * width);
        }
    CHECK(points.size() < 300);
  }
  for (const Vec3& p : sample_boundary(capsule, depth, width)) {
    const Vec3 axis(0, std::clamp(p[1], -0.35, 0.35), 0);
    CHECK((p - axis).norm() == Approx(0.3).epsilon(1e-12));
  }
  CHECK_THROWS_WITH(sample_boundary(box, 0.2, width), Contains("not thicker than 0.4 m"));
  CHECK_THROWS_WITH(sample_boundary(mesh, 0.25, width), Contains("not thicker than 0.5 m"));
  CHECK_THROWS_WITH(sample_boundary(box, depth, 1e-4), Contains("times as wide"));
}

TEST_CASE("a fluid names what it does not see", "[scene][fluid]") {
  CHECK(notes_of(basin(kBox + ", density = 500")).empty());
  const std::vector<std::string> body = notes_of(basin(kBox + ", density = 500", ""));
  REQUIRE(body.size() == 1);
  CHECK_THAT(body[0], Contains("does not see body 0: it flows through them") && Contains("bodies"));

  const auto scene = [](const std::string& fluid) {
    return R"(
local all = sim.particles { mass = 1 }
for i = 0, 4 do for j = 0, 4 do for k = 0, 4 do all:add { 0.1 * i, 0.1 * j, 0.1 * k } end end end
local ids = {}
for i = 0, 124 do ids[#ids + 1] = i end
for i = 0, 2 do for j = 0, 2 do all:add { 0.1 * i, 1, 0.1 * j } end end
all:add { 0, 3, 0 }
local cloth = sim.surface { particles = all, triangles = { {125,126,128}, {126,129,128},
  {127,130,126}, {126,130,129}, {128,129,131}, {129,132,131}, {129,130,132}, {130,133,132} } }
return sim.scene { particles = all, surfaces = { cloth }, forces = { sim.force.fluid { )" +
           fluid + R"( } }, integrator = 'verlet', dt = 0.0005, duration = 1 })";
  };
  const std::vector<std::string> all = notes_of(scene("particles = ids"));
  REQUIRE(all.size() == 1);
  CHECK_THAT(all[0],
             Contains("'fluid' at") && Contains("particles 125 to 134:") && Contains("solid"));
  const std::vector<std::string> one = notes_of(scene("particles = ids, solid = cloth"));
  REQUIRE(one.size() == 1);
  CHECK_THAT(one[0], Contains("does not see particle 134:"));
  CHECK(notes_of(scene("particles = all")).empty());
  for (const char* const boundary : {"sim.collider.plane {}", "{ sim.collider.plane {} }"}) {
    const std::vector<std::string> open =
        notes_of(scene("particles = all, boundary = " + std::string(boundary)));
    REQUIRE(open.size() == 1);
    CHECK_THAT(open[0], Contains("sim.collider.plane {") && Contains("none of the scene's"));
  }
}

TEST_CASE("bodies of a fluid that cannot be are refused by name", "[scene][fluid]") {
  const auto refused = [](const std::string& body, const std::string& more) {
    const auto error = text_error(basin(body, more));
    REQUIRE(error);
    return std::string(error->what());
  };
  const std::string box = kBox + ", density = 500";
  CHECK_THAT(refused(box, "bodies = 3"), Contains("list of bodies"));
  CHECK_THAT(refused(box, "bodies = { water }"), Contains("expected a sim.rigid"));
  CHECK_THAT(refused(box, "bodies = { body, body }"), Contains("in the list already"));
  CHECK_THAT(refused(box, "bodies = sim.rigid { shape = sim.sphere { radius = 1 }, mass = 1 }"),
             Contains("not in this scene"));
  CHECK_THAT(refused(box, "bodies = body, dimensions = 2"), Contains("two dimensions"));
  for (const char* const shape :
       {"sim.box { half = {0.1, 0.05, 0.1} }", "sim.sphere { radius = 0.1 }",
        "sim.capsule { radius = 0.08, length = 0.1 }"})
    for (const char* const touches : {"true", "false"})
      CHECK_THAT(refused("shape = " + std::string(shape) + ", position = {0.2, 0.2, 0.2}, turn = " +
                             "{0, 0.3, 0}, density = 500, touches = " + touches,
                         "bodies = body"),
                 Contains("inside"));
  CHECK_THAT(refused("shape = sim.box { half = {0.1, 0.03, 0.1} }, position = {0.2, 0.4, 0.2}, "
                     "mass = 1",
                     "bodies = body"),
             Contains("not thicker than"));
}
