// Steps that end where something is touched: adaptive methods, and others with accuracy = "event".
#include <catch2/catch.hpp>
#include <cmath>

#include "core/study/energy_balance.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Vec3;

namespace {

const char* const kAdaptive[] = {"dopri5", "tsit5", "dop853", "bs23", "rkf45"};

// An oscillator of omega = 7 rad/s about y = -1.2 and a wall at y = -1.3.
sim::SystemSpec make_walled_spring(double restitution) {
  sim::SystemSpec spec = make_vertical_spring(0);
  spec.particles->list.back().velocity = {0, -1.3, 0};
  spec.colliders = {
      make_part("plane", {{"restitution", restitution}, {"point", Vec3(0, -1.3, 0)}})};
  return spec;
}

Vec3 end_of(sim::SystemSpec spec, sim::Accuracy accuracy, const std::string& method,
            double duration, int steps) {
  sim::Registry registry = make_registry();
  spec.accuracy = accuracy;
  sim::Simulation system(spec, registry, {.integrator = {method}, .dt = duration / steps});
  REQUIRE(run(system, steps));
  return system.position(system.particles() - 1);
}

sim::RunOptions to_tolerance(const std::string& method, double tolerance, double dt) {
  return {.integrator = {method, {{"tol", tolerance}}}, .dt = dt};
}

}  // namespace

TEST_CASE("steps that end at touches keep the order of rk4, and those that put back do not") {
  const double s = std::sin(0.2), c = std::cos(0.2);
  struct Problem {
    sim::SystemSpec spec;
    double duration;
  };
  const Problem problems[] = {
      {make_walled_spring(1), 0.8},
      {make_particle({s, c, 0}, {0.5 * c, -0.5 * s, 0}, make_sphere()), 0.4},
      {make_particle({s, c, 0}, {0.5 * c, -0.5 * s, 0}, make_sphere()), 0.9},
      {make_particle({0.3, 1.5, 0}, {0, 0, 0}, make_sphere()), 0.6}};
  for (const Problem& problem : problems) {
    const auto at = [&](sim::Accuracy accuracy, int steps) {
      return end_of(problem.spec, accuracy, "rk4", problem.duration, steps);
    };
    const Vec3 exact = at(sim::Accuracy::kEvent, 4096);
    const double coarse = (at(sim::Accuracy::kEvent, 37) - exact).norm();
    const double fine = (at(sim::Accuracy::kEvent, 592) - exact).norm();
    const double settled = (at(sim::Accuracy::kSettle, 592) - exact).norm();
    const double projected = (at(sim::Accuracy::kProject, 592) - exact).norm();
    INFO(coarse << " " << fine << " settled " << settled << " projected " << projected);
    CHECK(fine < 1e-8);
    CHECK(std::log2(coarse / fine) / 4 > 3.5);
    CHECK(fine < 0.05 * settled);
    CHECK(settled < projected);
  }
}

TEST_CASE("elastic bounces in steps that end at touches keep the energy of the method") {
  sim::Registry registry = make_registry();
  for (const char* method : {"verlet", "rk4", "implicit_midpoint"}) {
    INFO(method);
    sim::SystemSpec spec = make_walled_spring(1);
    spec.accuracy = sim::Accuracy::kEvent;
    sim::Simulation spring(spec, registry, {.integrator = {method}, .dt = 0.005});
    const double before = spring.energy().total();
    double most = 0;
    for (int n = 0; n < 20000; ++n) {
      REQUIRE(spring.step());
      most = std::max(most, std::abs(spring.energy().total() - before));
    }
    CHECK(most < 2e-3);
    CHECK(spring.contact_work().lost < 1e-9);
  }
}

TEST_CASE("adaptive methods end their steps at touches, to their tolerance") {
  sim::Registry registry = make_registry();
  const double s = std::sin(0.2), c = std::cos(0.2);
  const Vec3 slid = end_of(make_particle({s, c, 0}, {0.5 * c, -0.5 * s, 0}, make_sphere()),
                           sim::Accuracy::kEvent, "rk4", 0.9, 4096);
  const double up = 0.8 * std::sqrt(2 * kGravity), lands = std::sqrt(2 / kGravity);
  for (const char* method : kAdaptive) {
    INFO(method);
    sim::Simulation ball(
        make_particle({0, 1, 0}, {0.5, 0, 0}, make_part("plane", {{"restitution", 0.8}})), registry,
        to_tolerance(method, 1e-8, 0.05));
    REQUIRE(run(ball, 22));
    const double after = ball.t() - lands;
    CHECK(ball.position(0).y() ==
          Approx(up * after - 0.5 * kGravity * after * after).epsilon(1e-6));
    sim::Simulation slides(make_particle({s, c, 0}, {0.5 * c, -0.5 * s, 0}, make_sphere()),
                           registry, to_tolerance(method, 1e-8, 0.05));
    for (int n = 0; n < 18; ++n) {
      REQUIRE(slides.step());
      CHECK(slides.position(0).norm() > 1 - 1e-8);
    }
    CHECK((slides.position(0) - slid).norm() < 1e-4);
  }
}

TEST_CASE("a ball that bounces ever lower comes to rest in adaptive methods, and says so") {
  sim::Registry registry = make_registry();
  for (const char* method : {"dopri5", "tsit5"}) {
    INFO(method);
    sim::Simulation ball(
        make_particle({0, 1, 0}, {0.5, 0, 0}, make_part("plane", {{"restitution", 0.5}})), registry,
        to_tolerance(method, 1e-6, 0.1));
    REQUIRE(run(ball, 40));
    CHECK(std::abs(ball.position(0).y()) < 1e-9);
    CHECK(std::abs(ball.velocity(0).y()) < 1e-6);
    CHECK(ball.position(0).x() == Approx(0.5 * ball.t()));
  }
}

// Flights whose heights are below the rounding of positions end in a rest.
TEST_CASE("the last of many bounces take adaptive methods no steps without number") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_particle(
      {-0.4, 0.756827, 0.190815}, {-0.486653, -0.866578, 0.576897},
      make_part("plane", {{"point", Vec3(0, 0.40633307, 0)}, {"restitution", 0.152026}}));
  for (const char* method : kAdaptive) {
    INFO(method);
    sim::Simulation ball(spec, registry, to_tolerance(method, 2e-6, 0.01));
    REQUIRE(run(ball, 40));
    CHECK(ball.integrator().effort().steps < 100);
    CHECK(std::abs(ball.position(0).y() - 0.40633307) < 1e-9);
    CHECK(std::abs(ball.velocity(0).y()) < 1e-6);
  }
}

// Two on a spring turn and slow down until friction holds them; their slips turn as they vanish.
TEST_CASE("slips that vanish take adaptive methods no steps without number") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_particle({0, 0, 0}, {1, 0, 0.5}, make_slope(0, 0.5));
  spec.particles->list.push_back({.position = {0.3, 0, 0}, .velocity = {0.5, 0, -0.7}});
  sim::PartSpec spring = make_springs("tie", 100);
  spring.elements.add({0, 1}, {{"rest", 0.3}});
  spec.forces.push_back(spring);
  sim::Simulation fine(spec, registry, {.integrator = {"verlet"}, .dt = 1e-5});
  REQUIRE(run(fine, 100'000));
  for (const char* method : kAdaptive) {
    INFO(method);
    sim::Simulation system(spec, registry, to_tolerance(method, 1e-5, 0.01));
    REQUIRE(run(system, 100));
    CHECK(system.integrator().effort().steps < 3000);
    for (int i = 0; i < 2; ++i) {
      CHECK((system.position(i) - fine.position(i)).norm() < 1e-3);
      CHECK(system.velocity(i).norm() == 0);
    }
  }
}

// Across the slope the slip of a creeping particle ends within microseconds.
TEST_CASE("slips that creep take adaptive methods no steps without number, and turn as they do") {
  constexpr double kAngle = 0.3, kBeyond = 1e-5, kSlip = 1e-5;
  const double friction = std::tan(kAngle) * (1 - kBeyond);
  const double a = 9.81 * std::sin(kAngle) * kBeyond;  // m/s^2
  const Vec3 down(-std::cos(kAngle), -std::sin(kAngle), 0);
  sim::Registry registry = make_registry();
  for (const char* method : kAdaptive)
    for (const Vec3& slip : {Vec3(0, 0, kSlip), Vec3(0.1 * kSlip * down + Vec3(0, 0, kSlip))}) {
      INFO(method << ", slip " << slip[0]);
      sim::Simulation system(make_particle({0, 0, 0}, slip, make_slope(kAngle, friction)), registry,
                             to_tolerance(method, 1e-6, 0.05));
      REQUIRE(run(system, 20));
      CHECK(system.integrator().effort().steps < 400);
      CHECK((system.position(0) - 0.5 * a * down).norm() < 3 * kSlip);
      CHECK(std::abs(system.velocity(0)[2]) < 0.1 * kSlip);
    }
}

TEST_CASE("what slides on a floor bounces off a wall in adaptive methods") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_particle({0, 0, 0}, {1, 0, 0}, make_part("plane"));
  spec.colliders.push_back(make_part(
      "plane", {{"point", Vec3(1, 0, 0)}, {"normal", Vec3(-1, 0, 0)}, {"restitution", 0.5}}));
  for (const char* method : kAdaptive) {
    INFO(method);
    sim::Simulation system(spec, registry, to_tolerance(method, 1e-3, 0.3));
    REQUIRE(run(system, 5));
    CHECK((system.position(0) - Vec3(1 - 0.5 * 0.5, 0, 0)).norm() < 1e-9);
  }
}

TEST_CASE("a wall that leans over throws what hits it no deeper than the floor") {
  sim::Registry registry = make_registry();
  for (const double restitution : {0.0, 0.3}) {
    sim::SystemSpec spec = make_particle({0, 0, 0}, {1, 0, 0}, make_part("plane"));
    spec.colliders.push_back(make_part(
        "plane",
        {{"point", Vec3(1, 0, 0)}, {"normal", Vec3(-1, -0.2, 0)}, {"restitution", restitution}}));
    for (const char* method : kAdaptive) {
      INFO(method);
      sim::Simulation system(spec, registry, to_tolerance(method, 1e-3, 0.3));
      for (int n = 0; n < 10; ++n) {
        REQUIRE(system.step());
        CHECK(system.position(0).y() > -1e-9);
        CHECK(system.position(0).x() < 1 + 1e-9);
      }
    }
  }
}

TEST_CASE("cut steps go on from snapshots with the same bits") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_walled_spring(0.9);
  spec.accuracy = sim::Accuracy::kEvent;
  for (const char* method :
       {"rk4", "verlet", "implicit_midpoint", "dopri5", "esdirk43", "trbdf2", "bdf2"}) {
    INFO(method);
    sim::Simulation whole(spec, registry, {.integrator = {method}, .dt = 0.013});
    sim::Simulation part(spec, registry, {.integrator = {method}, .dt = 0.013});
    REQUIRE(run(whole, 60));
    part.restore(whole.snapshot());
    REQUIRE(run(whole, 60));
    REQUIRE(run(part, 60));
    CHECK(part.hash() == whole.hash());
  }
}

// A method with steps of its own meets a surface before the states show it.
TEST_CASE("the balance knows of a touch when it is shown, also after a step back") {
  sim::PartSpec floor = make_part("plane", {{"restitution", 0.8}});
  const sim::SystemSpec bounce = make_particle({0, 1, 0}, {0, 0, 0}, floor);
  const sim::SystemSpec slide =
      make_particle({0, 0, 0}, {0, 0, 0}, make_slope(std::atan(0.5), 0.3));
  for (const sim::SystemSpec& spec : {bounce, slide})
    for (const char* method : kAdaptive) {
      INFO(method);
      sim::Registry registry = make_registry();
      sim::Simulation system(spec, registry, to_tolerance(method, 1e-6, 0.05));
      sim::study::EnergyBalance balance(system);
      const auto walk = [&](int steps) {
        for (int k = 0; k < steps; ++k) {
          REQUIRE(system.step());
          balance.advance();
          balance.look();
        }
      };
      walk(12);
      const sim::Snapshot before = system.snapshot();
      const double lost = system.contact_work().lost;
      walk(20);
      CHECK(std::abs(balance.error()) < 1e-4 * balance.in_play());
      const double taken = system.contact_work().lost - lost;
      CHECK(taken > 0.1);
      system.restore(before);
      const double again = system.contact_work().lost;
      REQUIRE(run(system, 20));
      CHECK(system.contact_work().lost - again == Approx(taken).epsilon(1e-9));
    }
}

// The second particle hits the wall at t = 0.2, which is the time of a state.
TEST_CASE("a touch at the time of a state is in its velocities and in its balance, or in neither") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec =
      make_particle({0, 0, 0}, {2, 0, 0.5}, make_part("plane", {{"friction", 0.3}}));
  spec.particles->list.push_back({.position = {0, 0.5, 0}, .velocity = {2, 0, 0}, .mass = 1});
  spec.colliders.push_back(make_part(
      "plane", {{"normal", Vec3(-1, 0, 0)}, {"point", Vec3(0.4, 0, 0)}, {"friction", 0.3}}));
  for (const char* method : kAdaptive) {
    INFO(method);
    sim::Simulation system(spec, registry, {.integrator = {method}, .dt = 0.005});
    sim::study::EnergyBalance balance(system);
    for (int n = 0; n < 100; ++n) {
      REQUIRE(system.step());
      balance.advance();
      balance.look();
    }
    CHECK(std::abs(balance.error()) < 1e-6 * balance.in_play());
  }
}

TEST_CASE("a shortened step counts what it touches") {
  const sim::SystemSpec spec =
      make_particle({0, 1, 0}, {0, 0, 0}, make_part("plane", {{"restitution", 0.8}}));
  for (const char* method : {"verlet", "rk4", "dopri5"}) {
    INFO(method);
    sim::Registry registry = make_registry();
    sim::Simulation system(spec, registry, {.integrator = {method}, .dt = 0.1});
    sim::study::EnergyBalance balance(system);
    REQUIRE(run(system, 4));
    REQUIRE(system.step_to(0.49));  // it hits at 0.4515 s
    balance.look();
    CHECK(system.contact_work().lost == Approx(9.81 * (1 - 0.64)).epsilon(1e-9));
    CHECK(std::abs(balance.error()) < 1e-9);
  }
}

TEST_CASE("esdirk43 costs what it costs without a collider while nothing lies on it") {
  sim::SystemSpec spec = make_cloth(8);
  sim::Registry registry = make_registry();
  const sim::RunOptions options = to_tolerance("esdirk43", 1e-6, 0.02);
  sim::Simulation without(spec, registry, options);
  spec.colliders = {make_part("sphere", {{"radius", 0.2}, {"center", Vec3(0, -20, 0)}})};
  sim::Simulation beside(spec, registry, options);
  REQUIRE((run(without, 20) && run(beside, 20)));
  CHECK((without.position(60) - beside.position(60)).norm() < 1e-5);
  const sim::Effort free = without.integrator().effort(), near = beside.integrator().effort();
  CHECK(free.newton > 0);
  CHECK(near.newton < 2 * free.newton);
  CHECK(near.evaluations < 2 * free.evaluations + 100);
}
