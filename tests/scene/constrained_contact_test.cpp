// Colliders that particles on rods meet, against closed forms. Impulses run through the rods.
#include <cmath>

#include "tests/support/bouncing_ball.h"
#include "tests/support/constrained_run.h"

using namespace sim;
using namespace sim::test;

namespace {

using Run = HeldRun;

}  // namespace

TEST_CASE("a pendulum bounces off a wall with its angular speed times e", "[scene][constraints]") {
  const std::string text =
      held_scene("{0, 0, 0}, {1, 0, 0}", "{0, 1}",
                 "sim.collider.plane { normal = {1, 0, 0}, restitution = 0.7 }", "p:pin(0)");
  for (const std::string method : {"rk4", "verlet", "midpoint", "yoshida4", "symplectic_euler"}) {
    INFO(method);
    Run run(text, method, 0.002);
    const double before = run.system.energy().total();
    run.run_to(0.8);  // it hits after 0.5921 s, at sqrt(2 g)
    // Half of v^2 and the height make up for what the bounce left.
    const double left = run.system.energy().total() + 2 * kG;
    CHECK(left == Approx(2 * kG * 0.49).epsilon(method == "symplectic_euler" ? 0.02 : 1e-4));
    CHECK(run.system.position(1)[0] > 0.1);
    CHECK(std::fabs(run.balance(before)) < (method == "symplectic_euler" ? 0.1 : 1e-3));
  }
  // A bounce costs no order: the touch is found on the way, and what follows is a step of its own.
  Run exact(text, "rk4", 1e-4);
  exact.run_to(0.8);
  const double end = exact.system.position(1)[0];
  const auto x = [](const Simulation& system) { return system.position(1)[0]; };
  CHECK(order_of(text, "rk4", 0.02, 0.8, end, x) > 3.3);
  CHECK(order_of(text, "verlet", 0.008, 0.8, end, x) > 1.8);
}

TEST_CASE("a dumbbell that falls obliquely gets the impulse of a rigid body",
          "[scene][constraints]") {
  // Two of 2 kg, 1 m apart, at 30 degrees; the lower one hits the floor at u. With the impulse P
  // the center gains P/4 and the spin P c / (2 m l), c = cos: gap' = (1 + c^2) P / 4 - u.
  const double c = std::sqrt(3.0) / 2, height = 0.3;
  const std::string text =
      held_scene("{0, 0.3, 0}, {" + std::to_string(c) + ", 0.8, 0}", "{0, 1}", kFloor);
  const double u = std::sqrt(2 * kG * height), push = 1.5 * u * 4 / (1 + c * c);
  for (const std::string method : {"rk4", "verlet"}) {
    INFO(method);
    Run run(text, method, 1e-4);
    const double before = run.system.energy().total();
    const double touch = u / kG;
    run.run_to(touch + 5e-4);
    const double after = run.system.t() - touch;
    const Vec3 v0 = run.system.velocity(0), v1 = run.system.velocity(1);
    CHECK(2 * (v0 + v1)[1] == Approx(push - 4 * kG * run.system.t()).epsilon(1e-6));
    CHECK(std::fabs((v0 + v1)[0]) < 1e-11);  // a floor without friction
    CHECK(v0[1] == Approx(0.5 * u - kG * after).epsilon(0.01));
    CHECK(run.system.contact_work().lost == Approx(0.5 * push * u * 0.5).epsilon(1e-5));
    CHECK(std::fabs(run.balance(before)) < 1e-5);
  }
  // Flat, both hit at once.
  Run flat(held_scene("{0, 0.3, 0}, {1, 0.3, 0}", "{0, 1}", kFloor), "rk4", 0.01);
  flat.run_to(0.3);
  const double since = 0.3 - u / kG;
  for (int i : {0, 1})
    CHECK(flat.system.position(i)[1] == Approx(0.5 * u * since - 0.5 * kG * since * since));
}

TEST_CASE("a dumbbell slides down a rough slope as one particle, or sticks",
          "[scene][constraints]") {
  // The slope falls by 30 degrees along x.
  const std::string points = "{0, 0, 0}, {0.8660254037844387, -0.5, 0}";
  const auto slope = [](const std::string& mu) {
    return "sim.collider.plane { normal = {0.5, 0.8660254037844387, 0}, friction = " + mu + " }";
  };
  for (const std::string method : {"rk4", "verlet"}) {
    INFO(method);
    Run slides(held_scene(points, "{0, 1}", slope("0.3")), method, 0.01);
    slides.run_to(0.5);
    const double a = kG * (0.5 - 0.3 * std::sqrt(3.0) / 2);
    CHECK(slides.system.velocity(0).norm() == Approx(a * 0.5).epsilon(1e-9));
    CHECK(slides.system.position(0).norm() == Approx(a * 0.125).epsilon(1e-9));
    Run sticks(held_scene(points, "{0, 1}", slope("1.3")), method, 0.01);
    sticks.run_to(0.5);
    CHECK(sticks.system.velocity(0).norm() < 1e-6);
    CHECK(sticks.system.position(0).norm() < 1e-6);
  }
}

TEST_CASE("a rope at rest over a cylinder: tensions and equilibrium", "[scene][constraints]") {
  constexpr int kLinks = 20;
  const std::string text = rope(kLinks, "0", "", "p:pin(0)");
  for (const std::string method : {"rk4", "verlet"}) {
    INFO(method);
    Run run(text, method, 0.002);
    run.run_to(0.2);
    for (int i = 0; i <= kLinks; ++i) CHECK(run.system.velocity(i).norm() < 1e-12);
    check_tensions(run, kLinks);
  }
}

TEST_CASE("a dumbbell slides in a bowl with order 2", "[scene][constraints]") {
  const std::string text = bowl("0");
  const auto height = [](const Simulation& system) {
    return 0.5 * (system.position(0) + system.position(1))[1];
  };
  Run exact(text, "rk4", 2.5e-4);
  exact.run_to(0.5);
  const double end = height(exact.system);
  CHECK(order_of(text, "verlet", 0.02, 0.5, end, height) > 1.8);
  CHECK(order_of(text, "rk4", 0.02, 0.5, end, height) > 1.8);
  // The surface does no work.
  const Vec3 v = exact.system.velocity(0), w = exact.system.velocity(1);
  CHECK(0.5 * (v.squaredNorm() + w.squaredNorm()) ==
        Approx(-2 * kG * (end + 0.25 * std::sqrt(3.0))).epsilon(1e-5));
}

namespace {

const std::string kSheet = sheet("sim.collider.plane { point = {0, -0.5, 0}, friction = 0.4 }");

}  // namespace

TEST_CASE("a sheet of rods falls on a ball: outside, on its rods, never gaining energy",
          "[scene][constraints]") {
  for (const std::string method : {"verlet", "rk4"}) {
    INFO(method);
    Run run(kSheet, method, 0.004);
    const double start = run.system.energy().total();
    double before = start, risen = 0;
    for (int n = 1; n <= 120; ++n) {
      run.run_to(0.004 * n);
      risen = std::max(risen, run.system.energy().total() - before);
      before = run.system.energy().total();
    }
    CHECK(run.system.contact_work().lost > 0.05);
    CHECK(risen < 2e-3 * run.system.contact_work().lost);
    CHECK(std::fabs(run.balance(start)) < 0.01 * start);
  }
}

TEST_CASE("contact on rods has the same bits on any threads, from snapshots and after .back",
          "[scene][constraints]") {
  const auto hash_of = [&](int threads) {
    const SceneFolder folder;
    Registry registry({SIM_PLUGIN_DIR});
    const SceneSpec spec =
        load_scene(folder.write("scene.lua", "local sim = require \"sim\"\n" + kSheet), registry,
                   {search_path(), {}, 0});
    Simulation system(spec.systems[0], registry, {{}, 0, threads});
    for (int n = 0; n < 60; ++n) REQUIRE(system.step());
    return system.hash();
  };
  const std::uint64_t hash = hash_of(1);
  CHECK(hash_of(4) == hash);

  Run run(kSheet, "verlet", 0.004);
  for (int n = 0; n < 40; ++n) REQUIRE(run.system.step());
  const Snapshot half = run.system.snapshot();
  for (int n = 0; n < 20; ++n) REQUIRE(run.system.step());
  CHECK(run.system.hash() == hash);
  run.system.restore(half);
  for (int n = 0; n < 20; ++n) REQUIRE(run.system.step());
  CHECK(run.system.hash() == hash);
}

TEST_CASE("moving colliders carry and throw what hangs on rods", "[scene][constraints]") {
  // A wall that comes with 1 m/s hits a pendulum at rest: (1 + e) V.
  const std::string text =
      held_scene("{0, 0, 0}, {0, -1, 0}", "{0, 1}",
                 "sim.collider.plane { point = {-0.205, 0, 0}, normal = {1, 0, 0}, "
                 "restitution = 0.6, motion = "
                 "sim.motion.line { velocity = {1, 0, 0} } }",
                 "p:pin(0)");
  for (const std::string method : {"rk4", "verlet"}) {
    INFO(method);
    Run run(text, method, 0.01);
    const double before = run.system.energy().total();
    run.run_to(0.21);
    CHECK(run.system.velocity(1)[0] == Approx(1.6).epsilon(1e-3));
    CHECK(run.system.contact_work().given > 0);
    CHECK(std::fabs(run.balance(before)) < 1e-3);
  }
  // A belt carries a dumbbell along as soon as it sticks, after V / (mu g).
  Run belt(held_scene(
               "{0, 0, 0}, {1, 0, 0}", "{0, 1}",
               "sim.collider.plane { friction = 0.5, motion = sim.motion.line { velocity = {1, 0, "
               "0} } }"),
           "verlet", 0.01);
  belt.run_to(0.5);
  CHECK(belt.system.velocity(0)[0] == Approx(1).epsilon(1e-6));
  CHECK(belt.system.position(0)[0] == Approx(0.5 - 0.5 / (0.5 * kG)).epsilon(1e-3));
}

// A rod falls onto a slope, gently enough not to end the step there, and slides off it towards a
// wall that it would reach after 0.0995 s. A bounce of a third particle ends the step at 0.0985 s.
TEST_CASE("who is pushed into a wall before it would have hit it hits it then",
          "[scene][constraints]") {
  TextRun run(
      "local p = sim.particles { mass = 1 }\n"
      "p:add({0, 0, 0}, { velocity = {0.01, 0, 0} })\n"
      "p:add({1, 0, 0}, { velocity = {0.01, 0, 0} })\n"
      "p:add({0.5, 6.5326, 0}, { velocity = {0, -10, 0} })\n"
      "return sim.scene { particles = p, forces = { sim.force.gravity {} },\n"
      "  constraints = { sim.constraint.distance { ties = { {0, 1} } } }, colliders = {\n"
      "    sim.collider.plane { point = {0, -0.02, 0}, normal = {1, 1, 0} },\n"
      "    sim.collider.plane { point = {1.000995, 0, 0}, normal = {-1, 0, 0} },\n"
      "    sim.collider.sphere { radius = 0.5, center = {0.5, 5, 0}, restitution = 0.5 } },\n"
      "  integrator = 'verlet', dt = 0.1, duration = 0.1 }",
      "verlet", 0.1);
  const double before = run.system.energy().kinetic;
  REQUIRE(run.system.step());
  CHECK(run.system.position(2)[1] > 5.5);
  CHECK(run.system.contact_work().lost > 0.7 * before);
  // It falls along the wall as if nothing held it, and the slope carries the other end.
  CHECK(run.system.position(1)[0] == Approx(1.000995));
  CHECK(run.system.velocity(1)[0] == Approx(0).margin(1e-9));
  CHECK(run.system.velocity(1)[1] == Approx(-0.1 * kG).epsilon(0.03));
  CHECK(run.system.velocity(0).norm() < 0.1);
}

TEST_CASE("what a hand does on rods is not charged to the floor that they touch",
          "[scene][constraints]") {
  // The upper end of a rod at 45 degrees is led along; the lower one slides on ice.
  const std::string text =
      "local p = sim.particles { mass = 1 }\n"
      "p:add({0, 1, 0})\np:add({1, 0, 0})\n"
      "p:prescribe(0, function(t) return {t * t, 1, 0}, {2 * t, 0, 0} end)\n"
      "return sim.scene { particles = p, forces = { sim.force.gravity {} },\n"
      "  constraints = { sim.constraint.distance { ties = { {0, 1} } } },\n"
      "  colliders = { sim.collider.plane { normal = {0, 1, 0} } },\n"
      "  integrator = 'rk4', dt = 0.01, duration = 1 }";
  for (const std::string method : {"rk4", "verlet"}) {
    INFO(method);
    TextRun run(text, method, 0.01);
    run.run_to(1);
    const ContactWork work = run.system.contact_work();
    CHECK(work.lost == Approx(0).margin(1e-4));
    CHECK(run.system.velocity(1)[0] == Approx(2).epsilon(1e-3));
  }
}

TEST_CASE("rods on a floor that is moved by a function bear what they bear on one that swings",
          "[scene][constraints]") {
  // A rod stands on a floor y = 0.05 sin(10 t), and its upper end of 1 kg with g and y''.
  const auto tension = [](const std::string& motion) {
    TextRun run(
        "local p = sim.particles { mass = 1 }\n"
        "p:add({0, 0, 0}, { velocity = {0, 0.5, 0} })\n"
        "p:add({0, 1, 0}, { velocity = {0, 0.5, 0} })\n"
        "return sim.scene { particles = p, forces = { sim.force.gravity {} },\n"
        "  constraints = { sim.constraint.distance { ties = { {0, 1} } } },\n"
        "  colliders = { sim.collider.plane { normal = {0, 1, 0}, motion = " +
            motion +
            " } },\n"
            "  integrator = 'verlet', dt = 0.01, duration = 1 }",
        "verlet", 0.01);
    run.run_to(0.4);
    const auto forces =
        run.system.constraint_system()->forces(run.system.t(), run.system.state().data());
    return forces.at(0).tension;
  };
  const double expected = -(kG - 5 * std::sin(4.0));
  CHECK(tension("sim.motion.swing { amplitude = {0, 0.05, 0}, period = 2 * math.pi / 10 }") ==
        Approx(expected).epsilon(1e-4));
  CHECK(tension("function(t) return {0, 0.05 * math.sin(10 * t), 0}, "
                "{0, 0.5 * math.cos(10 * t), 0} end") == Approx(expected).epsilon(1e-2));
}

TEST_CASE("what other constraints do where they meet colliders", "[scene][constraints]") {
  const auto with = [](const std::string& points, const std::string& constraint,
                       const std::string& collider) {
    return "local p = sim.particles {}\nfor _, x in ipairs { " + points +
           " } do p:add(x) end\nreturn sim.scene { particles = p, forces = { sim.force.gravity { g "
           "= {0, -9.81, 0} } }, constraints = { " +
           constraint + " }, colliders = { " + collider +
           " }, integrator = 'rk4', dt = 0.005, duration = 1 }\n";
  };
  // A bead on a circle comes to rest on a floor; a welded piece lies on three of its corners.
  Run bead(with("{1, 0, 0}",
                "sim.constraint.on_circle { particles = {0}, radius = 1, axis = {0, 0, 1} }",
                "sim.collider.plane { point = {0, -0.6, 0}, friction = 0.1 }"),
           "rk4", 0.005);
  bead.run_to(0.8);
  CHECK(bead.system.position(0)[1] == Approx(-0.6));
  CHECK(bead.system.velocity(0).norm() < 1e-9);
  Run substep(with("{0, 0.2, 0}, {1, 0.25, 0}, {0, 0.3, 1}, {0.4, 1.2, 0.4}",
                   "sim.constraint.weld { particles = {0, 1, 2, 3} }",
                   "sim.collider.plane { friction = 0.3 }"),
              "verlet", 0.005);
  substep.run_to(2);
  for (int i : {0, 1, 2}) CHECK(std::fabs(substep.system.position(i)[1]) < 1e-9);
  CHECK(substep.system.velocity(3).norm() < 1e-6);
}

TEST_CASE("where rods and colliders leave no room the run says so", "[scene][constraints]") {
  // A ball is pushed through a rope that is taut between two pins.
  const std::string text = held_scene(
      "{-0.5, 0, 0}, {0, 0.01, 0}, {0.5, 0, 0}", "{0, 1}, {1, 2}",
      "sim.collider.sphere { radius = 0.2, center = {0, -0.5, 0}, motion = sim.motion.line { "
      "velocity = {0, 1, 0} } }",
      "p:pin(0) p:pin(2)");
  for (const std::string method : {"rk4", "verlet"}) {
    INFO(method);
    Run run(text, method, 0.01);
    bool going = true;
    for (int n = 0; n < 100 && going; ++n) going = run.system.step();
    REQUIRE_FALSE(going);
    INFO(run.system.divergence().why);
    CHECK(contains(run.system.divergence().why, "leave no room"));
    CHECK(contains(run.system.divergence().why, "rod"));
    CHECK(run.system.t() > 0.2);
    for (const double x : run.system.state()) CHECK(std::isfinite(x));
  }
  const std::string rod = held_scene("{0, 1, 0}, {1, 1, 0}", "{0, 1}", kSmooth);
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string other = rod;
    other.replace(other.find(from), from.size(), to);
    return said(other);
  };
  CHECK(contains(refused("'rk4'", "'projective_dynamics'"), "knows springs alone"));
  CHECK(contains(refused("'rk4', dt", "'verlet', accuracy = 'event', dt"), "use rk4"));
  CHECK(contains(refused("dt = 0.01", "accuracy = 'project', dt = 0.01"), "\"settle\" or"));
  CHECK(contains(refused("{0, 1, 0}", "{0, -1, 0}"), "starts 1 m inside"));
}

TEST_CASE("what a hand puts into a collider comes out on its rods, at rest",
          "[scene][constraints]") {
  Run run(held_scene("{0, 0.5, 0}, {1, 0.5, 0}", "{0, 1}", kSmooth), "rk4", 0.001);
  run.system.set_velocity(0, {});
  run.system.set_position(0, {0, -0.1, 0});  // the other end is put back onto the rod
  REQUIRE(run.system.step());
  CHECK(run.deepest() < 1e-9);
  for (int i : {0, 1}) CHECK(run.system.velocity(i).norm() < 0.1);
}

// While some beads lie on the sphere others hit it, each at its moment.
TEST_CASE("a chain that lands on a sphere and slides off is of order 2") {
  const std::string chain = held_scene("{-0.02, 0.6, 0}, {0.08, 0.6, 0}, {0.18, 0.6, 0}",
                                       "{0, 1}, {1, 2}", "sim.collider.sphere { radius = 0.5 }");
  for (const char* const method : {"verlet", "rk4"}) {
    const auto end = [&](int steps) {
      Run run(chain, method, 0.3 / steps);
      for (int n = 0; n < steps; ++n) REQUIRE(run.system.step());
      return std::array{run.system.position(0), run.system.position(1), run.system.position(2)};
    };
    const auto reference = end(6400);
    double error[2];
    for (const int k : {0, 1}) {
      const auto at = end(k == 0 ? 100 : 800);
      error[k] = 0;
      for (std::size_t i = 0; i < 3; ++i)
        error[k] = std::max(error[k], (at[i] - reference[i]).norm());
    }
    INFO(method << " " << error[0] << " " << error[1]);
    CHECK(error[0] < 1e-5);
    CHECK(std::log2(error[0] / error[1]) / 3 > 1.8);
  }
}

// Upright rods of weights m g on a floor, or on a ball: each rod carries what is above it,
// whichever particle is first.
TEST_CASE("rods that stand on a collider are pressed by what they carry", "[scene][constraints]") {
  for (const bool upwards : {true, false})
    for (const std::string collider :
         {"sim.collider.plane {}", "sim.collider.sphere { radius = 2, center = {0, -2, 0} }"}) {
      INFO(collider << (upwards ? ", first below" : ", first above"));
      const std::string points = upwards ? "{0, 0, 0}, {0, 0.5, 0}, {0, 1, 0}, {0, 1.5, 0}"
                                         : "{0, 1.5, 0}, {0, 1, 0}, {0, 0.5, 0}, {0, 0, 0}";
      const HeldRun run(held_scene(points, "{0, 1}, {1, 2}, {2, 3}", collider), "rk4", 0.001);
      const std::vector<ConstraintForce> forces = run.forces();
      REQUIRE(forces.size() == 3);
      for (std::size_t rod = 0; rod < 3; ++rod) {
        const double carried = upwards ? 3.0 - static_cast<double>(rod) : rod + 1.0;
        CHECK(forces[rod].tension == Approx(-2 * kG * carried).epsilon(1e-9));
      }
    }
}

// Rods that fall flat, both ends at once: each bounces where and when it lands, in one step.
TEST_CASE("rods that land at several moments of one step bounce as single particles do",
          "[scene][constraints]") {
  const double e = 0.5, until = 0.4;
  const double heights[] = {0.3, 0.305, 0.31};  // 0.2473, 0.2493 and 0.2514 s
  for (const int rods : {1, 2, 3}) {
    std::string points, ties;
    for (int rod = 0; rod < rods; ++rod) {
      for (const double z : {0.0, 0.5})
        points += "{" + std::to_string(rod) + ", " + std::to_string(heights[rod]) + ", " +
                  std::to_string(z) + "}, ";
      ties += "{" + std::to_string(2 * rod) + ", " + std::to_string(2 * rod + 1) + "}, ";
    }
    for (const char* const method : {"implicit_midpoint", "trbdf2", "verlet", "rk4", "dopri5"}) {
      INFO(method << ", " << rods << " rods");
      HeldRun run(held_scene(points, ties, kFloor), method, 0.02);
      run.run_to(until);
      for (int i = 0; i < 2 * rods; ++i) {
        const double landed = std::sqrt(2 * heights[i / 2] / kG), after = until - landed;
        const double speed = e * kG * landed;
        CHECK(run.system.position(i).y() ==
              Approx(speed * after - 0.5 * kG * after * after).margin(1e-6));
        CHECK(run.system.velocity(i).y() == Approx(speed - kG * after).margin(1e-6));
      }
    }
  }
}

// The rod bounces as a ball does, and rests after 4.06 s.
TEST_CASE("a rod that falls flat bounces in steps of any length, until it rests",
          "[scene][constraints]") {
  const std::string text =
      held_scene("{0, 1, 0}, {1, 1, 0}", "{0, 1}",
                 "sim.collider.plane { normal = {0, 1, 0}, restitution = 0.8 }");
  for (const char* const method :
       {"verlet", "rk4", "dopri5", "dop853", "trbdf2", "implicit_midpoint"})
    for (const double h : {0.25, 0.1, 0.01}) {
      INFO(method << ", " << h);
      HeldRun run(text, method, h);
      for (double t = h; t < 5 + 0.5 * h; t += h) {
        INFO(t);
        run.run_to(t, 1e-7);
        for (const int i : {0, 1})
          CHECK(run.system.position(i).y() ==
                Approx(sim_test::bouncing_height(1, t, 0.8)).margin(1e-6));
      }
      CHECK(run.system.velocity(0).norm() < 1e-6);
    }
}

// Thirteen particles land one after the other, several in most steps of 16 ms.
TEST_CASE("a rope that lands at many moments of a step is followed from one to the next",
          "[scene][constraints]") {
  constexpr int kLinks = 12;
  std::string points, ties;
  for (int i = 0; i <= kLinks; ++i) {
    points += "{" + std::to_string(0.1 * i) + ", " +
              std::to_string(0.5 + 0.02 * i + 0.05 * std::sin(i)) + ", " +
              std::to_string(0.03 * std::cos(3 * i)) + "}, ";
    if (i > 0) ties += "{" + std::to_string(i - 1) + ", " + std::to_string(i) + "}, ";
  }
  const std::string text =
      held_scene(points, ties, "sim.collider.plane { normal = {0, 1, 0}, friction = 0.4 }");
  Run coarse(text, "verlet", 0.5 / 32), fine(text, "verlet", 0.5 / 2048);
  coarse.run_to(0.5);
  fine.run_to(0.5);
  for (int i = 0; i <= kLinks; ++i)
    CHECK((coarse.system.position(i) - fine.system.position(i)).norm() < 1e-3);
}
