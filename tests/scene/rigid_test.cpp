// Rigid bodies that nothing touches, against solutions of their own equations. The free top is of
// Jacobi's elliptic functions, which an extrapolation of Euler's equations with 40 digits confirms
// to 1e-22; the others are closed forms that stand with each test.
#include <cmath>

#include "core/particles/constraints/constraint_system.h"
#include "core/particles/rigid/rigid_rows.h"
#include "core/session/checkpoint.h"
#include "core/session/timeline.h"
#include "core/study/energy_balance.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

// A box of 1 kg with the moments 0.02, 0.05 and 0.06 kg m^2.
const char* const kFreeTop =
    "local b = sim.rigid { mass = 1, angular_velocity = {10, 1, -2}, shape = sim.box { half = "
    "{ math.sqrt(0.135), math.sqrt(0.045), math.sqrt(0.015) } } }\n"
    "return sim.scene { bodies = { b }, forces = {}, integrator = 'rk4', dt = 0.01, duration = 5 "
    "}\n";

struct Truth {
  double t;
  std::array<double, 4> q;
  Vec3 angular_velocity;
};
const Truth kTruth[] = {
    {0.5,
     {-0.7443661401481446, 0.4590933360792379, -0.44700624491182134, -0.18798344389445978},
     {6.9812057466917725, -0.12311751831007205, -7.49928938814291}},
    {1,
     {0.5784612705789831, -0.6850159148623106, -0.17317162793399427, 0.407611754129086},
     {7.3436802056341515, 5.511246132499387, -4.547513768735003}},
    {5,
     {0.0573250260535321, 0.8361738825544232, 0.22656747236004765, -0.4961796650309268},
     {6.114408439211214, 2.8052367956211697, -7.72380393647249}}};

double off_of(const RigidState& state, const Truth& truth) {
  const std::array<double, 4> q = state.quaternion();
  double dot = 0, off = 0;
  for (std::size_t k = 0; k < 4; ++k) dot += q[k] * truth.q[k];
  for (std::size_t k = 0; k < 4; ++k)
    off = std::max(off, std::fabs(q[k] - std::copysign(1.0, dot) * truth.q[k]));
  return std::max(off, 0.1 * (state.angular_velocity - truth.angular_velocity).norm());
}

double error_of_top(const std::string& method, double dt, const Truth& truth) {
  TextRun scene(kFreeTop, method, dt);
  scene.run_to(truth.t);
  return off_of(scene.system.body_state(0), truth);
}

Vec3 angular_momentum(const Simulation& system) {
  const RigidState state = system.body_state(0);
  return system.body(0).inertia(state) * state.angular_velocity;
}

}  // namespace

TEST_CASE("a free top turns as Jacobi's functions say", "[rigid]") {
  for (const Truth& truth : kTruth) CHECK(error_of_top("rk4", 1e-4, truth) < 1e-10);
  CHECK(error_of_top("dopri5", 0.1, kTruth[2]) < 1e-9);
  const auto order = [](const char* method, double dt) {
    return std::log2(error_of_top(method, dt, kTruth[1]) / error_of_top(method, dt / 2, kTruth[1]));
  };
  CHECK(order("rk4", 0.004) == Approx(4).margin(0.2));
  CHECK(order("verlet", 0.002) == Approx(2).margin(0.1));
  CHECK(order("yoshida4", 0.004) == Approx(4).margin(0.3));
  CHECK(order("implicit_midpoint", 0.004) == Approx(2).margin(0.2));
}

// The solver of constraints relies on it.
TEST_CASE("the rows of a body are orthogonal wherever it is rigid", "[rigid]") {
  TextRun scene(kFreeTop, "verlet", 0.01);
  scene.run_to(0.37);
  constexpr std::size_t kParticles = RigidBody::kParticles;
  double numbers[6][kParticles];
  for (std::size_t p = 0; p < kParticles; ++p)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      numbers[axis][p] = scene.system.position(static_cast<int>(p))[axis];
      numbers[3 + axis][p] = scene.system.velocity(static_cast<int>(p))[axis];
    }
  const ParticleView view{.n = kParticles,
                          .x = numbers[0],
                          .y = numbers[1],
                          .z = numbers[2],
                          .vx = numbers[3],
                          .vy = numbers[4],
                          .vz = numbers[5]};
  ThreadPool pool(1);
  const RigidRows rows({scene.system.body(0)}, pool);
  REQUIRE(rows.orthogonal());
  constexpr std::size_t kRows = 6;
  REQUIRE(rows.pattern().rows() == kRows);
  double phi[kRows], drive[kRows], bias[kRows];
  Vec3 gradient[kRows * kParticles];
  rows.evaluate(view, {phi, gradient, drive, bias});
  const auto product = [&](std::size_t a, std::size_t b) {
    double sum = 0;
    for (std::size_t p = 0; p < kParticles; ++p)
      sum += gradient[kParticles * a + p].dot(gradient[kParticles * b + p]);
    return sum;
  };
  for (std::size_t a = 0; a < kRows; ++a)
    for (std::size_t b = 0; b < a; ++b)
      CHECK(std::fabs(product(a, b)) < 1e-13 * std::sqrt(product(a, a) * product(b, b)));
}

TEST_CASE("momentum of a free top stays to rounding, and verlet keeps its energy", "[rigid]") {
  const Vec3 momentum(0.2, 0.05, -0.12);
  for (const char* method : {"verlet", "rk4"}) {
    TextRun scene(kFreeTop, method, 1e-3);
    CHECK((angular_momentum(scene.system) - momentum).norm() < 1e-15);
    double lowest = HUGE_VAL, highest = 0;
    for (int n = 0; n < 20000; ++n) {
      REQUIRE(scene.system.step());
      lowest = std::min(lowest, scene.system.energy().kinetic);
      highest = std::max(highest, scene.system.energy().kinetic);
    }
    const double drift = (angular_momentum(scene.system) - momentum).norm();
    if (std::string(method) == "verlet") {
      CHECK(drift < 1e-13);
      CHECK(highest - lowest < 1e-4 * 1.145);
    } else {
      CHECK(drift < 1e-8);
    }
    CHECK(scene.system.body_state(0).center.norm() < 1e-12);
  }
}

// With the moments A across and C along its axis about the tip, a top that leans by theta goes
// round evenly by W where A W^2 cos(theta) - C w W + m g l = 0, w its spin along its axis.
TEST_CASE("a heavy top goes round as evenly as it should", "[rigid]") {
  const std::string text =
      "local m, r, L, l, g, lean, W = 1, 0.05, 0.1, 0.12, 9.81, 0.4, 3\n"
      "local V, B = math.pi * r^2 * L, 4 * math.pi / 3 * r^3\n"
      "local rho = m / (V + B)\n"
      "local C = rho * (V * r^2 / 2 + B * 2 * r^2 / 5)\n"
      "local A = rho * (V * (r^2 / 4 + L^2 / 12) + B * (2 * r^2 / 5 + 3 * r * L / 8 + L^2 / 4)) "
      "+ m * l^2\n"
      "local w = (A * W^2 * math.cos(lean) + m * g * l) / (C * W)\n"
      "local axis = { math.sin(lean), math.cos(lean), 0 }\n"
      "local psi = w - W * axis[2]\n"
      "local spin = { psi * axis[1], psi * axis[2] + W, 0 }\n"
      "local at = { l * axis[1], l * axis[2], 0 }\n"
      "local top = sim.rigid { shape = sim.capsule { radius = r, length = L }, mass = m,\n"
      "  position = at, rotation = {0, 0, -lean}, angular_velocity = spin,\n"
      "  velocity = { 0, 0, -W * at[1] } }\n"
      "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\n"
      "return sim.scene { particles = p, bodies = { top }, forces = { sim.force.gravity { g = "
      "{0, -g, 0} } }, integrator = 'rk4', dt = 0.0002, duration = 1, constraints = { "
      "sim.constraint.joint {}:tie(top:at {0, -l, 0}, 0) } }\n";
  TextRun scene(text, "rk4", 5e-5);
  for (const double t : {0.25, 0.5, 1.0}) {
    scene.run_to(t);
    const double out = 0.12 * std::sin(0.4);
    const Vec3 truth(out * std::cos(3 * t), 0.12 * std::cos(0.4), -out * std::sin(3 * t));
    CHECK((scene.system.body_state(0).center - truth).norm() < 1e-8);
  }
}

// Springs of rest length 0 from points -+a to anchors -+A: the center swings as cos(sqrt(2 k / m)
// t), whatever the turn, and the turn about z is a pendulum of (2 k a A / I) sin(angle).
TEST_CASE("a body between two springs swings and turns without coupling", "[rigid]") {
  const double k = 30, m = 2, a = 0.3, A = 0.7, start = 1.2;
  const std::string text =
      "local b = sim.rigid { shape = sim.box { half = {0.3, 0.1, 0.2} }, mass = 2,\n"
      "  position = {0.05, -0.2, 0.1}, rotation = {0, 0, 1.2} }\n"
      "local p = sim.particles {}\np:add {-0.7, 0, 0}\np:add {0.7, 0, 0}\np:pin(0, 1)\n"
      "local s = sim.force.spring { stiffness = 30, rest = 0 }\n"
      "s:tie(b:at {-0.3, 0, 0}, 0):tie(1, b:at {0.3, 0, 0})\n"
      "return sim.scene { particles = p, bodies = { b }, forces = { s }, integrator = 'rk4', dt = "
      "0.001, duration = 1 }\n";
  // A period of the pendulum by the arithmetic-geometric mean of 1 and cos(start / 2).
  const double inertia = m / 3 * (0.09 + 0.01), rate = std::sqrt(2 * k * a * A / inertia);
  double x = 1, y = std::cos(start / 2);
  for (int n = 0; n < 8; ++n) {
    const double mean = 0.5 * (x + y);
    y = std::sqrt(x * y);
    x = mean;
  }
  const double period = 2 * 3.14159265358979323846 / (rate * x);
  const int steps = 400;
  TextRun scene(text, "rk4", period / steps);
  const double energy = scene.system.energy().total();
  study::EnergyBalance balance(scene.system);
  for (int n = 0; n < steps; ++n) {
    REQUIRE(scene.system.step());
    balance.advance();
  }
  balance.look();
  CHECK(balance.taken() == 0);  // by springs that are not damped
  const RigidState state = scene.system.body_state(0);
  CHECK((state.center - std::cos(std::sqrt(2 * k / m) * period) * Vec3(0.05, -0.2, 0.1)).norm() <
        1e-8);
  CHECK(2 * std::atan2(state.quaternion()[3], state.quaternion()[0]) == Approx(start).margin(1e-7));
  CHECK(scene.system.energy().total() == Approx(energy).epsilon(1e-8));
  CHECK(scene.system.families() == std::vector<std::pair<std::string, long>>{{"spring", 2}});
}

TEST_CASE("a dashpot on a body takes what the balance of energy says", "[rigid]") {
  const std::string text =
      "local b = sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 1, position = {0, -1, 0} "
      "}\n"
      "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\n"
      "local s = sim.force.spring { stiffness = 50, rest = 0.5, damping = 3 }\n"
      "s:tie(b:at {0, 0.1, 0}, 0)\n"
      "return sim.scene { particles = p, bodies = { b }, forces = { sim.force.gravity {}, s }, "
      "integrator = 'rk4', dt = 0.001, duration = 20 }\n";
  TextRun scene(text, "rk4", 1e-3);
  study::EnergyBalance balance(scene.system);
  const double energy = scene.system.energy().total();
  while (scene.system.t() < 15 - 1e-9) {
    REQUIRE(scene.system.step());
    balance.advance();
  }
  balance.look();
  const double lost = energy - scene.system.energy().total();
  CHECK(lost > 1);
  CHECK(balance.taken() == Approx(lost).epsilon(1e-5));
  // At rest where 50 (l - 0.5) = 9.81, l from the hook to the point.
  CHECK(scene.system.body_state(0).center.y() == Approx(-(0.5 + 9.81 / 50) - 0.1).margin(1e-9));
}

TEST_CASE("moments of a mesh are those of its box, however it is turned", "[rigid]") {
  // A box of 2 x 1 x 0.5 of twelve triangles, about another origin.
  RigidShape box{.form = RigidShape::Form::kBox, .half = {1, 0.5, 0.25}};
  RigidShape mesh{.form = RigidShape::Form::kMesh};
  const Mat3 turn = turned_by({0.3, -0.8, 1.1});
  for (int k = 0; k < 8; ++k)
    mesh.points.push_back(Vec3(3, 2, 1) +
                          turn * Vec3(k & 1 ? 1 : -1, k & 2 ? 0.5 : -0.5, k & 4 ? 0.25 : -0.25));
  for (const auto& [a, b, c, d] : std::initializer_list<std::array<int, 4>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  const MassProperties bulk = mass_properties(mesh);
  CHECK(bulk.volume == Approx(1).epsilon(1e-14));
  CHECK((bulk.center - Vec3(3, 2, 1)).norm() < 1e-14);
  const RigidBody a(std::make_shared<const RigidShape>(mesh), 3, 0);
  const RigidBody b(std::make_shared<const RigidShape>(box), 3, 0);
  RigidState turned;
  turned.axes = turn;
  const Mat3 ia = a.inertia({}), ib = b.inertia(turned);
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      CHECK(ia(row, column) == Approx(ib(row, column)).margin(1e-14));
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  CHECK_THROWS_AS(mass_properties(mesh), Error);
}

TEST_CASE("bodies go on from checkpoints and back in time bit for bit", "[rigid]") {
  for (const char* method : {"rk4", "verlet", "dopri5"}) {
    TextRun scene(kFreeTop, method, 0.01);
    scene.run_to(0.3);
    const Snapshot middle = scene.system.snapshot();
    scene.run_to(0.6);
    const std::uint64_t end = scene.system.hash();
    scene.system.restore(middle);
    scene.run_to(0.6);
    CHECK(scene.system.hash() == end);
  }
}

TEST_CASE("the accuracy of contact of particles changes no bit of bodies on a collider",
          "[rigid]") {
  const std::string text =
      "local b = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} }, mass = 8, friction = "
      "0.3,\n"
      "  restitution = 0.2, position = {0, 0.2, 0}, velocity = {0.5, 0, 0} }\n"
      "return sim.scene { bodies = { b }, forces = { sim.force.gravity {} }, colliders = {\n"
      "  sim.collider.plane { friction = 0.3, restitution = 0.2 } }, accuracy = 'ACCURACY',\n"
      "  integrator = 'rk4', dt = 0.002, duration = 0.3 }\n";
  for (const char* const method : {"rk4", "verlet", "implicit_midpoint"}) {
    INFO(method);
    std::vector<std::uint64_t> hashes;
    for (const std::string accuracy : {"settle", "project", "event"}) {
      std::string with = text;
      with.replace(with.find("ACCURACY"), 8, accuracy);
      TextRun scene(with, method, 0.002);
      scene.run_to(0.3);
      // It has landed, on the floor.
      CHECK(scene.system.body_state(0).center.y() == Approx(0.1).margin(0.01));
      hashes.push_back(scene.system.hash());
    }
    CHECK(hashes[1] == hashes[0]);
    CHECK(hashes[2] == hashes[0]);
  }
}
