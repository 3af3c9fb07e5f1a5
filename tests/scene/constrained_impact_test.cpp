// Adaptive and implicit methods where particles on rods meet colliders: rods and touches are solved
// for together, against closed forms and against each other.
#include "tests/support/constrained_run.h"

using namespace sim;
using namespace sim::test;

namespace {

const char* const kImplicit[] = {"implicit_midpoint", "trbdf2", "bdf2"};
const char* const kAdaptive[] = {"dopri5", "tsit5", "dop853", "bs23", "rkf45", "esdirk43"};

const std::string kPendulum =
    held_scene("{0, 0, 0}, {1, 0, 0}", "{0, 1}",
               "sim.collider.plane { normal = {1, 0, 0}, restitution = 0.7 }", "p:pin(0)");

std::string with(std::string text, const std::string& from, const std::string& to) {
  text.replace(text.find(from), from.size(), to);
  return text;
}

double x_of_last(const Simulation& system) { return system.position(system.particles() - 1)[0]; }
double y_of_last(const Simulation& system) { return system.position(system.particles() - 1)[1]; }

}  // namespace

TEST_CASE("implicit methods keep their order where a pendulum hits a wall",
          "[scene][constraints]") {
  HeldRun exact(kPendulum, "rk4", 1e-4);
  exact.run_to(0.8);
  const double end = x_of_last(exact.system);
  for (const std::string method : kImplicit) {
    INFO(method);
    CHECK(order_of(kPendulum, method, 0.01, 0.8, end, x_of_last) > 1.8);
    HeldRun run(kPendulum, method, 0.002);
    const double before = run.system.energy().total();
    run.run_to(0.8);
    CHECK(run.system.energy().total() + 2 * kG == Approx(2 * kG * 0.49).epsilon(2e-3));
    CHECK(std::fabs(run.balance(before)) < 5e-3);
  }
  CHECK(order_of(kPendulum, "implicit_euler", 0.01, 0.8, end, x_of_last) > 0.8);
  for (const std::string method : kAdaptive) {
    INFO(method);
    HeldRun run(kPendulum, method, 0.05);
    run.run_to(0.8);
    CHECK(x_of_last(run.system) == Approx(end).margin(2e-6));
  }
}

TEST_CASE("a dumbbell slides in a bowl with the order of each method, with and without friction",
          "[scene][constraints]") {
  for (const std::string friction : {"0", "0.2"}) {
    INFO("friction " << friction);
    const std::string text = bowl(friction);
    HeldRun exact(text, "dopri5", 0.05);  // to 1e-12
    exact.run_to(0.5, 1e-7);
    const double end = y_of_last(exact.system);
    for (const std::string method : kImplicit) {
      INFO(method);
      CHECK(order_of(text, method, 0.02, 0.5, end, y_of_last) > 1.8);
    }
    CHECK(order_of(text, "implicit_euler", 0.01, 0.5, end, y_of_last) > 0.8);
    for (const std::string method : kAdaptive) {
      INFO(method);
      HeldRun run(text, method, 0.05);
      run.run_to(0.5, 1e-4);
      CHECK(y_of_last(run.system) == Approx(end).margin(2e-5));
    }
    // Steps that end at touches and hold what lies have all of the order of rk4.
    const std::string cut = with(text, "dt = 0.01", "accuracy = 'event', dt = 0.01");
    CHECK(order_of(cut, "rk4", 0.05, 0.5, end, y_of_last) > 3.5);
  }
}

TEST_CASE("a rope rests over a cylinder in all methods, and slides off by their order",
          "[scene][constraints]") {
  constexpr int kLinks = 20;
  for (const std::string method : {"dopri5", "esdirk43", "implicit_euler", "trbdf2"}) {
    INFO(method);
    HeldRun run(rope(kLinks, "0", "", "p:pin(0)"), method, 0.01);
    run.run_to(0.1);
    for (int i = 0; i <= kLinks; ++i) CHECK(run.system.velocity(i).norm() < 1e-10);
    check_tensions(run, kLinks);
  }
  // With a weight at one end.
  const std::string slides = rope(kLinks, "0", "{0.3, -0.1, 0}");
  HeldRun exact(slides, "dopri5", 0.05);
  exact.run_to(0.5, 1e-7);
  const double end = y_of_last(exact.system);
  for (const std::string method : {"implicit_midpoint", "trbdf2", "bdf2"}) {
    INFO(method);
    CHECK(order_of(slides, method, 0.02, 0.5, end, y_of_last) > 1.8);
  }
}

TEST_CASE("friction of a rope on a cylinder holds a small weight and lets slide a larger one",
          "[scene][constraints]") {
  const std::string sticks = rope(20, "0.05", "{0.3, -0.1, 0}"),
                    slides = rope(20, "0.02", "{0.3, -0.1, 0}");
  HeldRun reference(slides, "rk4", 0.001);
  reference.run_to(0.5);
  for (const std::string method : {"dopri5", "tsit5", "implicit_midpoint", "trbdf2"}) {
    INFO(method);
    HeldRun held(sticks, method, 0.01);
    held.run_to(0.2, 1e-7);
    CHECK(y_of_last(held.system) == Approx(-0.1).margin(1e-6));
    HeldRun run(slides, method, 0.005);
    const double before = run.system.energy().total();
    run.run_to(0.5, 1e-6);
    CHECK(y_of_last(run.system) == Approx(y_of_last(reference.system)).margin(5e-4));
    CHECK(std::fabs(run.balance(before)) < 5e-3 * run.system.contact_work().lost);
  }
}

namespace {

const std::string kSheet = sheet("");

}  // namespace

TEST_CASE("a sheet of rods falls on a ball in implicit steps: outside, on its rods, in balance",
          "[scene][constraints]") {
  for (const std::string method : {"implicit_euler", "implicit_midpoint"}) {
    INFO(method);
    HeldRun run(kSheet, method, 0.004);
    const double start = run.system.energy().total();
    run.run_to(0.3);
    CHECK(run.system.contact_work().lost > 0.3);
    const double dissipated = method == std::string("implicit_euler") ? 0.2 : 0.02;
    CHECK(std::fabs(run.balance(start)) < dissipated * run.system.contact_work().lost);
  }
}

TEST_CASE("steps cut on rods go on from snapshots with the same bits", "[scene][constraints]") {
  const std::string text = rope(8, "0.02", "{0.3, -0.1, 0}");
  for (const std::string method : {"dopri5", "tsit5", "esdirk43", "trbdf2", "bdf2"}) {
    INFO(method);
    HeldRun whole(text, method, 0.01), part(text, method, 0.01);
    whole.run_to(0.3, 1e-6);
    part.system.restore(whole.system.snapshot());
    whole.run_to(0.6, 1e-6);
    part.run_to(0.6, 1e-6);
    CHECK(part.system.hash() == whole.system.hash());
  }
}

TEST_CASE("a wall that moves throws what hangs on rods in adaptive and implicit steps",
          "[scene][constraints]") {
  const std::string text = held_scene(
      "{0, 0, 0}, {0, -1, 0}", "{0, 1}",
      "sim.collider.plane { point = {-0.205, 0, 0}, normal = {1, 0, 0}, restitution = 0.6, motion "
      "= sim.motion.line { velocity = {1, 0, 0} } }",
      "p:pin(0)");
  for (const std::string method : {"dopri5", "trbdf2", "esdirk43"}) {
    INFO(method);
    HeldRun run(text, method, 0.01);
    const double before = run.system.energy().total();
    run.run_to(0.21);
    CHECK(run.system.velocity(1)[0] == Approx(1.6).epsilon(1e-3));
    CHECK(run.system.contact_work().given > 0);
    CHECK(std::fabs(run.balance(before)) < 1e-3);
  }
}

// A plate comes down on rods that nearly stand; the nearest place that rods and plates allow is not
// along the pushes of the start of the step.
TEST_CASE("a plate lays rods flat in implicit steps: outside, on the rods, as in small steps",
          "[scene][constraints]") {
  const struct {
    int rods;
    double angle, speed, dt;  // rad, m/s, s
  } cases[] = {
      {1, 1.328, 0.79, 0.04}, {1, 1.483, 0.67, 0.04}, {1, 1.46, 0.66, 0.02}, {3, 1.2, 0.3, 0.01}};
  for (const auto& [rods, angle, speed, dt] : cases) {
    const double high = 0.1 * std::sin(angle), wide = 0.1 * std::cos(angle);
    char plates[200];
    std::snprintf(plates, sizeof plates,
                  "sim.collider.plane {}, sim.collider.plane { point = {0, %.17g, 0}, normal = "
                  "{0, -1, 0}, motion = sim.motion.line { velocity = {0, %.17g, 0} } }",
                  high + 1e-9, -speed);
    std::string points, ties;
    for (int i = 0; i <= rods; ++i) {
      char text[100];
      std::snprintf(text, sizeof text, "{%.17g, %.17g, 0}, ", wide * i, i % 2 ? high : 0.0);
      points += text;
      if (i > 0) ties += "{" + std::to_string(i - 1) + ", " + std::to_string(i) + "}, ";
    }
    INFO(angle << " rad, " << rods << " rods");
    const std::string text = held_scene(points, ties, plates);
    HeldRun exact(text, "verlet", 2e-4), run(text, "implicit_midpoint", dt);
    exact.run_to(0.08);
    run.run_to(0.08);
    for (int i = 0; i <= rods; ++i)
      CHECK((run.system.position(i) - exact.system.position(i)).norm() < 2 * dt);
  }
}
