// Scenes with a plane: bounces, sliding, rest, and that nothing of it shows where nothing touches.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/particles/particle_system.h"
#include "core/session/checkpoint.h"
#include "core/session/timeline.h"
#include "tests/lua/scene_text.h"
#include "tests/support/bouncing_ball.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

sim::PartSpec make_plane(double restitution, const sim::Vec3& normal = {0, 1, 0},
                         const sim::Vec3& point = {0, 0, 0}) {
  return make_part("plane", {{"restitution", restitution}, {"normal", normal}, {"point", point}});
}

// A ball of 1 kg at the height of 1 m above the plane y = 0.
sim::SystemSpec make_ball(double restitution, const sim::Vec3& velocity = {0.5, 0, 0}) {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list[0].position = {0, 1, 0};
  spec.particles->list[0].velocity = velocity;
  spec.colliders = {make_plane(restitution)};
  return spec;
}

// A cloth that falls on a slanted plane, one corner held.
sim::SystemSpec make_draped(int n) {
  sim::SystemSpec spec = make_cloth(n);
  spec.particles->pinned = {0};
  spec.colliders = {make_plane(0.2, {0.3, 1, 0.1}, {0, -0.25, 0})};
  return spec;
}

const char* const kSettled[] = {"rk4",   "verlet",   "symplectic_euler", "trapezoid",
                                "pefrl", "yoshida4", "midpoint",         "rk3"};

}  // namespace

TEST_CASE("a ball bounces as the closed form says") {
  sim::Registry registry = make_registry();
  for (const char* method : {"rk4", "verlet", "midpoint", "rk3", "trapezoid"})
    for (const double e : {0.5, 0.8}) {
      INFO(method << " " << e);
      sim::Simulation ball(make_ball(e), registry, {.integrator = {method}, .dt = 0.0101});
      double worst = 0;
      for (int n = 0; n < (e == 0.8 ? 300 : 100); ++n) {
        REQUIRE(ball.step());
        worst = std::max(worst, std::abs(ball.position(0).y() - bouncing_height(1, ball.t(), e)));
      }
      CHECK(worst < 1e-12);
      CHECK(ball.position(0).x() == Approx(0.5 * ball.t()));
    }
}

// Flights of less than a thousandth of a step, which rise by 1e-6 g h^2 / 8, are rest.
TEST_CASE("balls that bounce many times within a step are where the closed form says") {
  sim::Registry registry = make_registry();
  constexpr double kStep = 0.25, kRise = 1e-6 * kGravity * kStep * kStep / 8;
  for (const char* method : {"verlet", "rk4", "pefrl"})
    for (const double e : {0.5, 0.8, 0.9}) {
      INFO(method << " " << e);
      sim::Simulation ball(make_ball(e), registry, {.integrator = {method}, .dt = kStep});
      for (int n = 0; n < 60; ++n) {
        REQUIRE(ball.step());
        CHECK(std::abs(ball.position(0).y() - bouncing_height(1, ball.t(), e)) < kRise);
      }
      CHECK(std::abs(ball.position(0).y()) < kRise);

      // Nine of them lie on the plane at the start, side by side.
      sim::SystemSpec row = make_ball(e);
      row.particles->list.clear();
      for (int k = 0; k < 9; ++k)
        row.particles->list.push_back(
            {.position = {0.3 * k, 0, 0}, .velocity = {0.5, -0.2 * (k + 1), 0}, .mass = 1});
      sim::Simulation balls(row, registry, {.integrator = {method}, .dt = kStep});
      REQUIRE(balls.step());
      for (int k = 0; k < 9; ++k)
        CHECK(std::abs(balls.position(k).y() - height_after_impact(kStep, 0.2 * (k + 1), e)) <
              kRise);
    }
  // Velocities of a method of first order are not those of its paths.
  sim::Simulation ball(make_ball(0.8), registry, {.integrator = {"symplectic_euler"}, .dt = kStep});
  REQUIRE(run(ball, 60));
  CHECK(std::abs(ball.position(0).y()) < kRise);
}

TEST_CASE("a ball that stopped bouncing lies still on the plane and slides on") {
  sim::Registry registry = make_registry();
  for (const char* method : kSettled) {
    INFO(method);
    sim::Simulation ball(make_ball(0.5), registry, {.integrator = {method}, .dt = 0.01});
    REQUIRE(run(ball, 400));
    const sim::Vec3 before = ball.position(0);
    CHECK(std::abs(before.y()) < 1e-12);
    CHECK(ball.velocity(0).y() ==
          Approx(0).margin(method == std::string("symplectic_euler") ? 1e-5 : 1e-12));
    REQUIRE(run(ball, 100));
    CHECK(std::abs(ball.position(0).y() - before.y()) < 1e-13);
    CHECK(ball.velocity(0).x() == 0.5);
  }
}

TEST_CASE("a particle slides down an incline without friction as the closed form says") {
  sim::Registry registry = make_registry();
  const double c = std::cos(0.5), s = std::sin(0.5);
  for (const char* method : {"rk4", "verlet", "pefrl"}) {
    INFO(method);
    sim::SystemSpec spec = make_falling(2, 0);
    spec.particles->list[0] = {.mass = 2};
    spec.colliders = {make_plane(0.3, {-s, c, 0})};
    sim::Simulation slide(spec, registry, {.integrator = {method}, .dt = 0.01});
    REQUIRE(run(slide, 100));
    const sim::Vec3 x = slide.position(0);
    CHECK(x.dot(sim::Vec3(c, s, 0)) == Approx(-0.5 * kGravity * s).epsilon(1e-12));
    CHECK(std::abs(x.dot(sim::Vec3(-s, c, 0))) < 1e-13);
  }
}

TEST_CASE("a spring against a wall converges with order two") {
  sim::Registry registry = make_registry();
  // An oscillator of omega = 7 rad/s about y = -1.2, a wall at y = -1.3, e = 0.6.
  const auto end_of = [&](const char* method, int steps) {
    sim::SystemSpec spec = make_vertical_spring(0);
    spec.particles->list.back().velocity = {0, -1.3, 0};
    spec.colliders = {make_plane(0.6, {0, 1, 0}, {0, -1.3, 0})};
    sim::Simulation spring(spec, registry, {.integrator = {method}, .dt = 0.8 / steps});
    REQUIRE(run(spring, steps));
    return spring.position(spring.particles() - 1).y();
  };
  for (const char* method : {"rk4", "verlet"}) {
    const double exact = end_of(method, 65536);
    const double coarse = std::abs(end_of(method, 100) - exact);
    const double fine = std::abs(end_of(method, 1600) - exact);
    INFO(method << " " << coarse << " " << fine);
    CHECK(fine > 0);
    CHECK(std::log2(coarse / fine) / 4 > 1.7);
  }
}

TEST_CASE("no particle of a cloth is inside after any step, and pinned ones never move") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_draped(12);
  const sim::Vec3 normal = sim::Vec3(0.3, 1, 0.1).normalized();
  for (const char* method : kSettled) {
    INFO(method);
    sim::Simulation cloth(spec, registry, {.integrator = {method}, .dt = 1e-3});
    const sim::Vec3 held = cloth.position(0);
    double deepest = 1;
    int collide = 0;
    for (int n = 0; n < 1200; ++n) {
      REQUIRE(cloth.step());
      collide = 0;
      for (int i = 0; i < cloth.particles(); ++i) {
        const double gap = normal.dot(cloth.position(i) - sim::Vec3(0, -0.25, 0));
        deepest = std::min(deepest, gap);
        collide += gap < 1e-9;
      }
    }
    CHECK(deepest > -1e-12);
    CHECK(collide > 5);
    CHECK((cloth.position(0) - held).norm() == 0);
    CHECK(cloth.energy().total() < 0);
  }
}

TEST_CASE("a pinned particle inside a collider stays there") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_chain({{0, -0.1, 0}, {0.25, 0.2, 0}, {0.5, 0.1, 0}}, {0}, 0.1);
  spec.colliders = {make_plane(0)};
  sim::Simulation chain(spec, registry, {.integrator = {"verlet"}, .dt = 1e-3});
  REQUIRE(run(chain, 500));
  CHECK(chain.position(0).y() == -0.1);
  CHECK(chain.position(1).y() >= -1e-12);
}

TEST_CASE("contact keeps the bits over threads, snapshots, checkpoints and travels in time") {
  sim::Registry registry = make_registry();
  for (const char* method : {"rk4", "verlet", "pefrl", "yoshida4"}) {
    INFO(method);
    const sim::SystemSpec spec = make_draped(12);
    const sim::RunOptions options{.integrator = {method}, .dt = 2e-3};
    sim::Simulation whole(spec, registry, options), part(spec, registry, options);
    REQUIRE(run(whole, 400));
    REQUIRE(run(part, 250));
    sim::Simulation resumed(spec, registry, {.dt = 0.5});
    const auto saved = sim::decode(sim::encode({"", {}, 0, {sim::checkpoint(part, spec, 0)}}), "f");
    sim::resume(resumed, spec, saved.systems.front(), registry);
    REQUIRE(run(resumed, 150));
    CHECK(resumed.hash() == whole.hash());
    sim::Timeline timeline(part);
    while (part.step_count() < 400) REQUIRE(timeline.step(part));
    CHECK(part.hash() == whole.hash());
    REQUIRE(timeline.go_to(part, 333, [] { return true; }));
    REQUIRE(timeline.go_to(part, 400, [] { return true; }));
    CHECK(part.hash() == whole.hash());

    sim::SystemSpec large = make_draped(72);
    large.colliders[0].given["point"] = sim::Vec3(0, -0.0005, 0);
    large.particles->pinned = {};
    large.colliders[0].given["normal"] = sim::Vec3(0, 1, 0);
    const auto with = [&](int threads) {
      sim::Simulation simulation(large, registry,
                                 {.integrator = {method}, .dt = 1e-3, .threads = threads});
      REQUIRE(run(simulation, 15));
      return simulation.hash();
    };
    CHECK(with(1) == with(2));
  }
}

TEST_CASE("a plane that nothing comes near changes no result") {
  sim::Registry registry = make_registry();
  sim::SystemSpec with = make_cloth(12);
  with.colliders = {make_plane(0.5, {0, 1, 0}, {0, -10, 0})};
  for (const char* method : {"rk4", "trapezoid"}) {
    sim::Simulation a(with, registry, {.integrator = {method}, .dt = 2e-3});
    sim::Simulation b(make_cloth(12), registry, {.integrator = {method}, .dt = 2e-3});
    REQUIRE((run(a, 50) && run(b, 50)));
    CHECK(a.hash() == b.hash());
  }
  sim::Simulation a(with, registry, {.integrator = {"verlet"}, .dt = 2e-3});
  sim::Simulation b(make_cloth(12), registry, {.integrator = {"verlet"}, .dt = 2e-3});
  REQUIRE((run(a, 50) && run(b, 50)));
  for (int i = 0; i < a.particles(); ++i) CHECK((a.position(i) - b.position(i)).norm() < 1e-13);
}

TEST_CASE("methods that do not know of contact are refused with what to take instead") {
  sim::Registry registry = make_registry();
  CHECK_THROWS_WITH(
      sim::Simulation(make_draped(6), registry, {.integrator = {"projective_dynamics"}}),
      Catch::Contains("colliders") && Catch::Contains("use rk4, verlet"));
  sim::RunOptions single{.integrator = {"rk4", {{"precision", std::string("single")}}}};
  CHECK_THROWS_WITH(sim::Simulation(make_draped(6), registry, single),
                    Catch::Contains("colliders are double precision only"));
  sim::Simulation automatic(make_draped(6), registry, {.integrator = {"auto"}});
  CHECK(run(automatic, 50));
}

TEST_CASE("a particle put behind a plane by hand comes out in the next step at rest") {
  sim::Registry registry = make_registry();
  for (const char* method : {"rk4", "verlet"}) {
    sim::Simulation ball(make_ball(0.5, {0, 0, 0}), registry, {.integrator = {method}, .dt = 0.01});
    ball.set_position(0, {0, -0.25, 0});
    REQUIRE(ball.step());
    CHECK(std::abs(ball.position(0).y()) < 1e-12);
    CHECK(ball.velocity(0).norm() < 1e-12);
  }
}

TEST_CASE("surfaces that do not turn are known by numbers, with the gaps of their own queries") {
  using Form = sim::PrimitiveSurface::Form;
  const std::string swing = ", motion = sim.motion.swing { amplitude = {0.1, 0.2, 0}, period = 2 }";
  const std::string line = ", motion = sim.motion.line { velocity = {1, 2, 3} }";
  const std::string spin = ", motion = sim.motion.spin { axis = {0, 0, 1}, period = 3 }";
  const std::string plane = "plane { point = {0, -2, 0}, normal = {0.3, 1, 0.1}, thickness = 0.02";
  const std::string ball = "sphere { center = {0, -2, 0}, radius = 0.5, thickness = 0.02";
  const std::string bowl = "sphere { radius = 5, inside = true";
  const struct {
    std::string text;
    Form form;
  } cases[] = {
      {plane, Form::kPlane},      {plane + line, Form::kPlane}, {plane + swing, Form::kPlane},
      {ball, Form::kSphere},      {ball + line, Form::kSphere}, {ball + swing, Form::kSphere},
      {ball + spin, Form::kNone}, {bowl, Form::kSphere},        {bowl + line, Form::kSphere}};
  for (const auto& [text, form] : cases) {
    INFO(text);
    sim::test::TextRun run(
        "local p = sim.particles { mass = 1 }\np:add {0, 1, 0}\nreturn sim.scene { particles = p, "
        "forces = {}, colliders = { sim.collider." +
            text + " } }, integrator = 'rk4', dt = 0.01, duration = 1 }\n",
        "rk4", 0.01);
    const auto& particles = dynamic_cast<const sim::ParticleSystem&>(run.system.ode());
    REQUIRE(particles.contacts().all().size() == 1);
    const sim::Collider& collider = *particles.contacts().all()[0];
    for (const double t : {0.0, 0.3, 0.9}) {
      const sim::PrimitiveSurface surface = collider.as_primitive(t);
      REQUIRE(surface.form == form);
      for (int k = 0; k < 20 && form != Form::kNone; ++k) {
        const sim::Vec3 x(std::sin(3.0 * k), std::sin(5.0 * k + 1), std::sin(7.0 * k + 2));
        const sim::SurfaceSample sample = collider.query(t, x);
        CHECK(surface.gap(x) == Approx(sample.gap).margin(1e-14));
        CHECK((surface.velocity - sample.velocity).norm() < 1e-14);
      }
    }
  }
}

namespace {

// The colliders of a scene with a particle far away; walls of a room count each.
std::vector<const sim::Collider*> colliders_of(const sim::test::TextRun& run) {
  const auto& particles = dynamic_cast<const sim::ParticleSystem&>(run.system.ode());
  std::vector<const sim::Collider*> list;
  for (const auto& each : particles.contacts().all()) list.push_back(&*each);
  return list;
}

std::string scene_with(const std::string& collider) {
  return "local p = sim.particles { mass = 1 }\np:add {0.1, 0.05, 0}\nreturn sim.scene { "
         "particles = p, forces = {}, colliders = { sim.collider." +
         collider + " }, integrator = 'rk4', dt = 0.01, duration = 1 }\n";
}

}  // namespace

// The gap changes by no more than the way (it is a distance), so that in a box it is at least that
// of the middle less the half diagonal; a clearance lies between that and the gap anywhere in it.
TEST_CASE("the clearance of a box is a bound of the gaps in it, and no poor one") {
  const std::string ways[] = {
      "", ", motion = sim.motion.swing { amplitude = {0.1, 0.2, 0}, period = 2 }",
      ", motion = sim.motion.spin { axis = {1, 0, 2}, period = 3 }"};
  for (const std::string shape :
       {"plane { point = {0, -2, 0}, normal = {0.3, 1, 0.1}",
        "sphere { center = {1, 2, 0}, radius = 0.5", "sphere { radius = 5, inside = true",
        "box { center = {0, 2, 0}, half = {0.5, 0.3, 0.7}",
        "box { center = {0, 2, 0}, half = {0.5, 0.3, 0.7}, turn = {0.2, 0.5, 0.3}",
        "box { half = {4, 5, 6}, inside = true",
        "capsule { a = {1, 1, 0}, b = {1, 3, 1}, radius = 0.3",
        "capsule { a = {-1, 0, 0}, b = {1, 0, 0}, radius = 4, inside = true"})
    for (const std::string& way : ways) {
      if (shape.starts_with("plane") && way.find("spin") != way.npos) continue;  // it may not turn
      INFO(shape << way);
      const sim::test::TextRun run(scene_with(shape + ", thickness = 0.02" + way + " }"), "rk4",
                                   0.01);
      for (const sim::Collider* const collider : colliders_of(run))
        for (int k = 0; k < 24; ++k) {
          const double t = 0.1 * k;
          const sim::Vec3 middle(3 * std::sin(3.0 * k), 3 * std::sin(5.0 * k + 1),
                                 std::sin(7.0 * k)),
              half(0.1 + 0.02 * k, 0.5 / (k + 1), k % 3 == 0 ? 0 : 0.3);
          const double bound = collider->clearance(t, middle, half);
          CHECK(bound >= collider->query(t, middle).gap - half.norm() - 1e-12);
          double least = HUGE_VAL;
          for (int i = 0; i < 27; ++i) {
            const sim::Vec3 off((i % 3 - 1) * half.x(), (i / 3 % 3 - 1) * half.y(),
                                (i / 9 - 1) * half.z());
            least = std::min(least, collider->query(t, middle + off).gap);
          }
          CHECK(bound <= least + 1e-12);
        }
    }
}

// The center's speed, and omega r of what a rotation moves other than along the surface.
TEST_CASE("the speed of a surface is bounded by its closed form") {
  constexpr double kOmega = 2 * 3.14159265358979323846 / 3;
  const auto spin = [](const std::string& axis) {
    return ", motion = sim.motion.spin { axis = {" + axis + "}, period = 3 } }";
  };
  const std::string line = ", motion = sim.motion.line { velocity = {2, -1, 2} } }",
                    rod = "capsule { a = {0, 1, 0}, b = {0, 1, 4}, radius = 0.3";
  const struct {
    std::string text;
    double speed;
  } cases[] = {{"sphere { center = {1, 2, 0}, radius = 0.5 }", 0},
               {"sphere { center = {1, 2, 0}, radius = 0.5" + line, 3},
               {"sphere { center = {1, 2, 0}, radius = 0.5" + spin("0, 1, 1"), 0},
               {"sphere { radius = 9, inside = true" + spin("1, 0, 0"), 0},
               {rod + spin("0, 0, 1"), kOmega * 0.3},
               {rod + spin("1, 0, 0"), kOmega * (2 + 0.3)},
               {rod + spin("0, 3, 4"), kOmega * (2 * 0.6 + 0.3)},
               {"box { center = {0, 9, 0}, half = {2, 1, 2}" + spin("0, 0, 1"), kOmega * 3},
               {"box { center = {0, 9, 0}, half = {2, 1, 2}" + line, 3}};
  for (const auto& [text, speed] : cases) {
    INFO(text);
    const sim::test::TextRun run(scene_with(text), "rk4", 0.01);
    REQUIRE(colliders_of(run).size() == 1);
    CHECK(colliders_of(run)[0]->max_speed(0.2, 0.3) == Approx(speed).margin(1e-12));
  }
}
