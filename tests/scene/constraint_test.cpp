// Scenes with constraints against solutions in coordinates of their own. The numbers come from
// 40-digit integrations: of Jacobi's elliptic functions (the pendulum), of Lagrange's equations in
// angles (the others); two methods agree on each to 1e-17 or better.
#include <cmath>

#include "core/particles/constraints/constraint_system.h"
#include "core/scene/memory_estimate.h"
#include "core/session/checkpoint.h"
#include "core/session/timeline.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

const char* const kGravityForce = "forces = { sim.force.gravity { g = {0, -9.81, 0} } }, ";
const char* const kRun = "integrator = 'rk4', dt = 0.01, duration = 1 }\n";

// A point of 1 kg on a rod of 1 m from the origin.
std::string pendulum(const std::string& start, const std::string& constraint) {
  return "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\np:add(" + start +
         ")\nreturn sim.scene { particles = p, " + kGravityForce + "constraints = { " + constraint +
         " }, " + kRun;
}

const char* const kRod = "sim.constraint.distance { ties = { {0, 1} } }";

std::string chain(const std::string& points, int links, const std::string& more = "") {
  std::string ties;
  for (int i = 0; i < links; ++i)
    ties += "{" + std::to_string(i) + ", " + std::to_string(i + 1) + "}, ";
  return "local p = sim.particles {}\nfor _, x in ipairs { " + points +
         " } do p:add(x) end\np:pin(0)\n" + more + "return sim.scene { particles = p, " +
         kGravityForce + "constraints = { sim.constraint.distance { ties = { " + ties + "} } }, " +
         kRun;
}

const std::string kDouble = chain("{0, 0, 0}, {1, 0, 0}, {2, 0, 0}", 2);

struct Scene : TextRun {
  using TextRun::TextRun;
  double off(int i, const Vec3& x) const { return (system.position(i) - x).norm(); }

  std::vector<ConstraintForce> forces() const {
    return system.constraint_system()->forces(system.t(), system.state().data());
  }
  ConstraintDrift drift() const {
    return system.constraint_system()->drift(system.t(), system.state().data());
  }
};

// The observed order from three step sizes, each half of the one before.
double order_of(const std::string& text, const std::string& method, double dt, int i,
                const Vec3& end, double t = 1) {
  double errors[2];
  for (int k = 0; k < 2; ++k) {
    Scene scene(text, method, k == 0 ? dt : dt / 2);
    scene.run_to(t);
    errors[k] = scene.off(i, end);
  }
  return std::log2(errors[0] / errors[1]);
}

const Vec3 kDoubleEnd(-1.444818849943476, -1.3217944613814645, 0);  // of its lower bead at 1 s

}  // namespace

TEST_CASE("a rigid pendulum swings as the elliptic functions say") {
  struct Frame {
    double t;
    Vec3 x;
    double tension;
  };
  const Frame frames[] = {{0.5, {0.3910487915505463, -0.9203699487851923, 0}, 27.08648759274821},
                          {1.0, {-0.9862917511318753, -0.16501085312554115, 0}, 4.8562694074846755},
                          {2.0, {0.7935661953433218, -0.6084839304437913, 0}, 17.907682072960778}};
  for (const auto& [method, dt, bound] :
       {std::tuple("rk4", 5e-4, 1e-10), {"dopri5", 0.05, 1e-9}, {"yoshida4", 1e-3, 1e-8}}) {
    INFO(method);
    Scene scene(pendulum("{1, -6.123233995736766e-17, 0}", kRod), method, dt);
    for (const Frame& frame : frames) {
      scene.run_to(frame.t);
      CHECK(scene.off(1, frame.x) < bound);
      CHECK(std::abs(scene.forces()[0].tension - frame.tension) < 100 * bound);
      CHECK(scene.drift().position < 1e-14);
      CHECK(scene.drift().velocity < 1e-13);
    }
  }
}

TEST_CASE("a rigid pendulum goes over the top") {
  Scene scene(pendulum("{0, -1, 0}, { velocity = {7, 0, 0} }", kRod), "rk4", 5e-4);
  scene.run_to(2);
  CHECK(scene.off(1, {-0.19886138109789306, 0.9800276277268098, 0}) < 2e-9);
  CHECK(scene.forces()[0].tension == Approx(0.5377869159999844).epsilon(1e-6));
}

TEST_CASE("every method keeps its order with constraints") {
  const std::pair<const char*, double> methods[] = {{"rk4", 0.01},
                                                    {"rk3", 0.01},
                                                    {"midpoint", 0.005},
                                                    {"trapezoid", 0.005},
                                                    {"verlet", 0.005},
                                                    {"yoshida4", 0.005},
                                                    {"implicit_midpoint", 0.005},
                                                    {"trbdf2", 0.005},
                                                    {"bdf2", 0.0025},
                                                    {"euler", 2e-4},
                                                    {"symplectic_euler", 2e-4},
                                                    {"implicit_euler", 5e-4}};
  for (const auto& [method, dt] : methods) {
    INFO(method);
    Registry registry = sim_test::make_registry();
    const int claimed = sim_test::info_of(method, registry).order;
    CHECK(std::abs(order_of(kDouble, method, dt, 2, kDoubleEnd) - claimed) < 0.2);
  }
}

TEST_CASE("a double pendulum keeps its energy for long with RATTLE") {
  Scene scene(kDouble, "verlet", 0.005);
  const double start = scene.system.energy().total();
  double worst = 0, off = 0;
  for (int n = 0; n < 10000; ++n) {
    REQUIRE(scene.system.step());
    worst = std::max(worst, std::abs(scene.system.energy().total() - start));
    off = std::max(off, scene.drift().position);
  }
  CHECK(worst < 0.05);  // of 29 J in play
  CHECK(off < 1e-13);
}

TEST_CASE("a bead on a turning hoop is where it should be, and the hoop does the work") {
  const char* const kHoop[] = {
      "sim.constraint.on_circle { particles = {0}, radius = 1, axis = function(t) return "
      "{-math.sin(5*t), 0, math.cos(5*t)} end }",
      "sim.constraint.on_curve { particles = {0}, from = -4, to = 4, curve = function(s, t) return "
      "{math.sin(s)*math.cos(5*t), -math.cos(s), math.sin(s)*math.sin(5*t)} end }"};
  for (const std::string hoop : kHoop) {
    INFO(hoop);
    const std::string text =
        "local p = sim.particles { mass = 0.5 }\np:add({0.8414709848078965, -0.5403023058681398, "
        "0}, { velocity = {0, 0, 4.207354924039483} })\nreturn sim.scene { particles = p, " +
        std::string(kGravityForce) + "constraints = { " + hoop + " }, " + kRun;
    Scene scene(text, "rk4", 1e-3);
    scene.run_to(1);
    CHECK(scene.off(0, {0.2625092541261865, -0.37892069778348575, -0.8874164728521718}) < 2e-9);
    const Vec3 force = scene.forces()[0].force;
    CHECK((force - Vec3(-4.707248988573837, 4.863451831432203, 10.994221602336244)).norm() < 1e-7);
    // d/dt of what is kept in the turning frame: P = omega dL/dt.
    CHECK(scene.system.constraint_system()->driving_power(scene.system.t(),
                                                          scene.system.state().data()) ==
          Approx(force.dot(scene.system.velocity(0))).epsilon(1e-9));
    for (const char* method : {"rk4", "verlet"})
      CHECK(std::abs(order_of(text, method, 5e-3, 0,
                              {0.2625092541261865, -0.37892069778348575, -0.8874164728521718}) -
                     (method[0] == 'r' ? 4 : 2)) < 0.2);
  }
}

TEST_CASE("a hanging chain has the tensions of the catenary") {
  const std::string text = chain(
      "{0, 0, 0}, {0.2950666902182148, -0.40365288098026514, 0}, {0.75, -0.611103317593424, 0}, "
      "{1.2049333097817851, -0.40365288098026514, 0}, {1.5, 0, 0}",
      4, "p:pin(4)\n");
  Scene scene(text, "rk4", 0.001);
  scene.run_to(0.1);
  const double tensions[] = {18.22729465508191, 11.82210093186391, 11.82210093186391,
                             18.22729465508191};
  for (std::size_t k = 0; k < 4; ++k)
    CHECK(std::abs(scene.forces()[k].tension - tensions[k]) < 1e-8);
  CHECK(scene.off(2, {0.75, -0.611103317593424, 0}) < 1e-12);
}

TEST_CASE("a bead slides down a helix as on a slope") {
  // Arc length has the acceleration -g sin(slope): height = -g t^2 / 2 sin^2.
  const std::string text =
      "local p = sim.particles {}\np:add {1, 0, 0}\nreturn sim.scene { particles = p, " +
      std::string(kGravityForce) +
      "constraints = { sim.constraint.on_curve { particles = {0}, curve = function(s) return "
      "{math.cos(s), s / 5, math.sin(s)} end } }, " +
      kRun;
  const double square = (1.0 / 25) / (1 + 1.0 / 25);
  for (const char* method : {"rk4", "verlet", "dopri5"}) {
    INFO(method);
    Scene scene(text, method, 2e-4);
    scene.run_to(1);
    CHECK(scene.system.position(0).y() ==
          Approx(-0.5 * sim_test::kGravity * square).epsilon(method[0] == 'v' ? 1e-7 : 1e-9));
  }
}

TEST_CASE("a welded piece is rigid and keeps its momenta") {
  const std::string text =
      "local p = sim.particles { mass = 0.3 }\nfor k, x in ipairs { {0, 0, 0}, {1, 0, 0}, {0, 1, "
      "0}, {1, 1, 0}, {0.3, 0.2, 0.7} } do p:add(x, { velocity = {x[2], -x[1] + x[3], 0.5 * x[1] "
      "* k * 0 + x[2] * 0.25} }) end\nreturn sim.scene { particles = p, forces = {}, constraints = "
      "{ sim.constraint.weld { particles = {0, 1, 2, 3, 4} } }, " +
      std::string(kRun);
  Scene scene(text, "rk4", 2e-3);
  const auto momenta = [&] {
    Vec3 linear, angular;
    for (int i = 0; i < 5; ++i) {
      linear += scene.system.velocity(i);
      angular += scene.system.position(i).cross(scene.system.velocity(i));
    }
    return std::pair(linear, angular);
  };
  const auto [p, l] = momenta();
  const double energy = scene.system.energy().kinetic;
  scene.run_to(5);
  CHECK((momenta().first - p).norm() < 1e-12);
  CHECK((momenta().second - l).norm() < 1e-8);
  CHECK(scene.system.energy().kinetic == Approx(energy).epsilon(1e-8));
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < i; ++j) {
      const auto& list = scene.spec.systems[0].particles->list;
      CHECK(std::abs((scene.system.position(i) - scene.system.position(j)).norm() -
                     (list[static_cast<std::size_t>(i)].position -
                      list[static_cast<std::size_t>(j)].position)
                         .norm()) < 1e-12);
    }
}

TEST_CASE("redundant rods move as the others alone") {
  const std::string square =
      "local p = sim.particles {}\nfor _, x in ipairs { {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0} "
      "} do p:add(x) end\nreturn sim.scene { particles = p, " +
      std::string(kGravityForce) +
      "constraints = { sim.constraint.distance { ties = { {0,1}, {1,2}, {2,3}, {3,0}, {0,2}, {1,3} "
      "} } }, " +
      kRun;
  for (const char* method : {"rk4", "verlet", "implicit_midpoint", "dopri5"}) {
    INFO(method);
    Scene scene(square, method, 0.01);
    CHECK(contains(scene.system.ode().notes().at(0), "depend on each other"));
    scene.run_to(1);
    CHECK(scene.off(2, {1, 1 - 4.905, 0}) < 1e-12);
    for (const ConstraintForce& each : scene.forces()) CHECK(std::abs(each.tension) < 1e-9);
  }
  Scene twice(pendulum("{1, -6.123233995736766e-17, 0}",
                       "sim.constraint.distance { ties = { {0, 1}, {0, 1} } }"),
              "rk4", 5e-4);
  twice.run_to(1);
  CHECK(twice.off(1, {-0.9862917511318753, -0.16501085312554115, 0}) < 1e-10);
  const auto forces = twice.forces();
  CHECK(forces[0].tension + forces[1].tension == Approx(4.8562694074846755).epsilon(1e-8));
}

TEST_CASE("a taut chain between two pins ends with words or with numbers") {
  for (const char* method : {"rk4", "verlet"}) {
    Scene scene(chain("{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}", 3, "p:pin(3)\n"), method, 0.01);
    CHECK(contains(scene.system.ode().notes().at(0), "have no bound where they are taut"));
    for (int n = 0; n < 50 && scene.system.step(); ++n)
      for (int i = 0; i < 4; ++i) CHECK(scene.system.position(i).allFinite());
  }
}

TEST_CASE("masses far apart on one rod keep it") {
  const std::string text =
      "local p = sim.particles {}\np:add({0, 0, 0}, { mass = 1e9 })\np:add({1, 0, 0}, { mass = "
      "1e-9, velocity = {0, 3, 0} })\nreturn sim.scene { particles = p, forces = {}, constraints = "
      "{ sim.constraint.distance { ties = { {0, 1} } } }, " +
      std::string(kRun);
  Scene scene(text, "rk4", 1e-3);
  scene.run_to(3);
  CHECK(scene.drift().position < 1e-14);
  CHECK(scene.off(1, {std::cos(9), std::sin(9), 0}) < 1e-9);
}

TEST_CASE("constrained runs go on bit for bit") {
  const std::string bead =
      "local p = sim.particles {}\np:add {0.8, -0.6, 0}\nreturn sim.scene { particles = p, " +
      std::string(kGravityForce) + "constraints = { ";
  const std::string scenes[] = {
      chain("{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}", 3),
      bead +
          "sim.constraint.on_circle { particles = {0}, radius = 1, axis = function(t) return {-"
          "math.sin(5*t), 0, math.cos(5*t)} end } }, " +
          kRun,
      bead +
          "sim.constraint.on_curve { particles = {0}, from = -4, to = 4, curve = function(s) "
          "return "
          "{math.sin(s), -math.cos(s), 0.3 * math.sin(2 * s)} end } }, " +
          kRun};
  for (const std::string& text : scenes)
    for (const char* method : {"rk4", "verlet", "yoshida4", "dopri5", "implicit_midpoint"}) {
      INFO(method << '\n' << text);
      Scene scene(text, method, 0.01);
      for (int n = 0; n < 60; ++n) REQUIRE(scene.system.step());
      const Snapshot snapshot = scene.system.snapshot();
      for (int n = 0; n < 60; ++n) REQUIRE(scene.system.step());
      const std::uint64_t hash = scene.system.hash();
      scene.system.restore(snapshot);
      for (int n = 0; n < 60; ++n) REQUIRE(scene.system.step());
      CHECK(scene.system.hash() == hash);
    }
}

TEST_CASE("a change by hand keeps to the constraints") {
  Scene scene(kDouble, "verlet", 0.01);
  scene.system.set_velocity(2, {1, 1, 0});
  CHECK(scene.drift().velocity < 1e-15);
  CHECK(scene.system.velocity(2).y() == 1);
  scene.system.set_position(2, {2, 0.1, 0});
  CHECK(scene.drift().position < 1e-15);
  CHECK(scene.system.step());
}

TEST_CASE("damping and forces of velocity keep the order of RATTLE") {
  const std::string text =
      "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\np:add {1, 0, 0}\np:add({2, 0, 0}, { "
      "mass = 0.2 })\nreturn sim.scene { particles = p, forces = { sim.force.gravity { g = {0, "
      "-9.81, 0} }, sim.force.drag { k = 0.8 }, sim.force.expression { fx = '-0.3*vx*abs(vx)', fy "
      "= "
      "'-0.2*vy' } }, constraints = { sim.constraint.distance { ties = { {0, 1}, {1, 2} } } }, " +
      std::string(kRun);
  Scene fine(text, "dopri5", 0.1);
  fine.run_to(1);
  for (const auto& [method, order] : {std::pair("verlet", 2), {"rk4", 4}})
    CHECK(std::abs(order_of(text, method, 0.005, 2, fine.system.position(2)) - order) < 0.2);
}

TEST_CASE("what RATTLE cannot reach is too far, not a number that is not finite") {
  Scene scene(
      "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\np:add {1, 0, 0}\np:add({2, 0, 0}, { "
      "velocity = {0, 10000, 0} })\nreturn sim.scene { particles = p, forces = {}, constraints = { "
      "sim.constraint.distance { ties = { {0, 1}, {1, 2} } } }, " +
          std::string(kRun),
      "verlet", 0.01);
  while (scene.system.step() && scene.system.t() < 1) {}
  const std::string& why = scene.system.divergence().why;
  INFO(why);
  CHECK(contains(why, "no allowed state is in reach"));
  CHECK(std::stod(why.substr(why.find("off by ") + 7)) < 1e8);
}

namespace {

// A rope of 1 m and 0.1 kg, let go at one end; link i of n begins at these coordinates.
std::string long_rope(int rods, const std::string& x = "i / n", const std::string& y = "0") {
  return "local n = " + std::to_string(rods) +
         "\nlocal p, ties = sim.particles { mass = 0.1 / n }, {}\nfor i = 0, n do p:add { " + x +
         ", " + y +
         ", 0 } end\np:pin(0)\nfor i = 1, n do ties[i] = { i - 1, i } end\nreturn sim.scene { "
         "particles = p, " +
         kGravityForce +
         "constraints = { sim.constraint.distance { ties = ties, length = 1 / n } }, " + kRun;
}

}  // namespace

TEST_CASE("drifts beyond the limit of SHAKE converge and keep the energy") {
  // Tension and length of 200 links of a rope that swings set a limit of some 1.6 ms.
  const std::string text = long_rope(200, "0.3 * i / n", "-math.sqrt(1 - 0.09) * i / n");
  Scene fine(text, "rk4", 0.0005);
  fine.run_to(0.24);
  double errors[2];
  for (int k = 0; k < 2; ++k) {
    Scene scene(text, "verlet", k == 0 ? 0.008 : 0.004);
    const double before = scene.system.energy().total();
    scene.run_to(0.24);
    CHECK(scene.system.constraint_system()->implicit_drifts() > 0);
    CHECK(scene.drift().position < 1e-13);
    CHECK(scene.drift().velocity < 1e-12);
    CHECK(std::fabs(scene.system.energy().total() - before) < 2e-4);
    errors[k] = 0;
    for (int i = 0; i <= 200; ++i)
      errors[k] = std::max(errors[k], scene.off(i, fine.system.position(i)));
  }
  INFO(errors[0] << " " << errors[1]);
  CHECK(errors[0] < 1e-3);
  CHECK(std::log2(errors[0] / errors[1]) > 1.4);
  Scene below(text, "verlet", 0.0005);
  below.run_to(0.01);
  CHECK(below.system.constraint_system()->implicit_drifts() == 0);
}

TEST_CASE("ropes of many rods keep to them in their own step") {
  for (const int rods : {1000, 4000}) {
    INFO(rods);
    Scene scene(long_rope(rods), "verlet", 0.002);
    const double before = scene.system.energy().total();
    scene.run_to(0.1);
    CHECK(scene.drift().position < 1e-12);
    CHECK(scene.drift().velocity < 1e-11);
    CHECK(std::fabs(scene.system.energy().total() - before) < 1e-5);
    // The free end falls freely until the bend reaches it.
    CHECK(scene.system.position(rods).y() == Approx(-0.5 * 9.81 * 0.01).epsilon(1e-9));
  }
}

TEST_CASE("a rod that turns far in a step is led there in parts") {
  Scene scene(
      "local p = sim.particles {}\np:add {0, 0, 0}\np:pin(0)\np:add({1, 0, 0}, { velocity = {0, "
      "1000, 0} })\nreturn sim.scene { particles = p, forces = {}, constraints = { " +
          std::string(kRod) + " }, " + kRun,
      "verlet", 0.01);
  REQUIRE(scene.system.step());
  CHECK(scene.drift().position < 1e-14);
  CHECK(scene.system.velocity(1).norm() == Approx(1000).epsilon(1e-12));
  // Each of 4 parts turns it by 2 atan(h v / 2 l) = 1.79 instead of 2.5.
  const double turn = 4 * 2 * std::atan(0.01 / 4 * 1000 / 2);
  CHECK(scene.off(1, {std::cos(turn), std::sin(turn), 0}) < 1e-9);
}

TEST_CASE("implicit methods on constraints need room for the vectors of GMRES") {
  const SceneSpec spec = load("scenes/rope.lua", {{"n", "1000"}});
  Registry registry = sim_test::make_registry();
  const double explicit_bytes = memory_estimate(spec.systems[0], {}, registry).total();
  const double bytes = memory_estimate(spec.systems[0], {.implicit = true}, registry).total();
  CHECK(bytes - explicit_bytes > 81 * 6 * 8 * 1001.0);
}
