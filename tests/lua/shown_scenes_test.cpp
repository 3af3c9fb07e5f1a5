// Scenes that come with the program, each against its closed form or a reference of its own.
#include <cmath>
#include <numbers>

#include "core/scene/simulation.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kG = 9.80665;  // m/s^2, or what the scene says

struct SceneRun {
  SceneRun(const std::string& name, const sim::test::Settings& settings = {},
           const std::string& method = "", double dt = 0)
      : spec(load("scenes/" + name + ".lua", settings)),
        system(spec.systems[0], registry, options(method, dt)) {}
  void run_to(double t) {
    while (system.t() < t - 1e-9 * system.h()) REQUIRE(system.step());
  }
  static RunOptions options(const std::string& method, double dt) {
    RunOptions options{.dt = dt};
    if (!method.empty()) options.integrator = MethodChoice{method};
    return options;
  }

  Registry registry{{SIM_PLUGIN_DIR}};
  SceneSpec spec;
  Simulation system;
};

double gravity_of(const SystemSpec& spec) {
  for (const PartSpec& part : spec.forces)
    if (const auto g = part.given.find("g"); part.plugin == "gravity" && g != part.given.end())
      return -std::get<Vec3>(g->second).y();
  return 9.81;
}

}  // namespace

TEST_CASE("planets.lua turns as Lagrange's triangle", "[scenes][shown]") {
  SceneRun run("planets");
  run.run_to(12);
  const std::vector<double> exact = run.spec.systems[0].exact(run.system.t());
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis)
      CHECK(std::fabs(run.system.position(i)[axis] -
                      exact[static_cast<std::size_t>(3 * i + axis)]) < 1e-6);
  // Once round in 2 pi sqrt(side^3 / (G M)), by Kepler's third law.
  const double mass = 1 + 9.55e-4 + 1e-6;
  const double period = std::sqrt(5.2 * 5.2 * 5.2 / mass);
  const Vec3 start = run.spec.systems[0].particles->at(1).position;
  SceneRun around("planets", {}, "yoshida4", period / 800);
  around.run_to(period);
  CHECK((around.system.position(1) - start).norm() < 1e-6);
}

TEST_CASE("foucault.lua turns its plane by the sine of the latitude", "[scenes][shown]") {
  const double length = 10, start = 0.01, day = 300, latitude = 48.85 * std::numbers::pi / 180;
  SceneRun run("foucault", {{"start", "0.01"}});
  const double up = 2 * std::numbers::pi / day * std::sin(latitude);
  const double g = gravity_of(run.spec.systems[0]);
  const double omega = std::sqrt(g / length + up * up);
  for (const double t : {20.0, 100.0, 200.0}) {
    run.run_to(t);
    // Small swings: z = e^(-i W t) a (cos w t + i W/w sin w t), seen from above with x to the east
    // and -z to the north (Foucault 1851; the ellipse of a start at rest is in it).
    const double u = run.system.t(), c = std::cos(omega * u), s = up / omega * std::sin(omega * u);
    const double east = start * (std::cos(up * u) * c + std::sin(up * u) * s);
    const double north = start * (-std::sin(up * u) * c + std::cos(up * u) * s);
    const Vec3 at = run.system.position(1);
    CAPTURE(t);
    CHECK(std::fabs(at.x() - east) < 2e-3 * start);
    CHECK(std::fabs(-at.z() - north) < 2e-3 * start);
  }
}

TEST_CASE("tensegrity.lua comes to rest with its ends turned by 30 degrees", "[scenes][shown]") {
  for (const char* turn : {"45", "20"}) {
    SceneRun run("tensegrity", {{"turn", turn}});
    run.run_to(20);
    CAPTURE(turn);
    CHECK(run.spec.systems[0].observe(run.system)[0] == Approx(30).epsilon(1e-4));
    // Force densities, q = tension / length: of the upright cables 1, of the struts -1, of the ends
    // 1 / sqrt(3) (Motro 2003).
    double ends = 0, upright = 0, strut = 0;
    for (const Link& link : run.system.links(0)) {
      const double length = (run.system.position(0) - run.system.position(link.to)).norm();
      const double density = link.tension(length) / length;
      (link.family == "strut" ? strut : link.to < 3 ? ends : upright) = density;
    }
    CHECK(upright > 0);
    CHECK(strut == Approx(-upright).epsilon(1e-3));
    CHECK(ends == Approx(upright / std::sqrt(3.0)).epsilon(1e-3));
  }
}

TEST_CASE("trampoline.lua swings as a stretched net does", "[scenes][shown]") {
  // The lowest mode of a square net of N x N meshes under the tension T, with masses m a distance s
  // apart: w^2 = 8 T / (m s) sin^2(pi / 2N).
  constexpr int n = 12;
  SceneRun run("trampoline", {{"n", "12"}, {"drop", "100"}});
  Simulation& net = run.system;
  const double s = 2.0 / n, rest = s / 1.1, tension = 4000 * (s - rest), mass = 4.0 / 169;
  const double sine = std::sin(std::numbers::pi / (2 * n));
  const double omega = std::sqrt(8 * tension / (mass * s)) * sine;
  // It hangs a little by its own weight: half a period after a start in the shape of the mode the
  // mode's share of the shape has come round. So the difference of two runs is looked at.
  SceneRun other("trampoline", {{"n", "12"}, {"drop", "100"}});
  const double far = 1e-5;
  for (int i = 1; i < n; ++i)
    for (int j = 1; j < n; ++j) {
      const int id = i * (n + 1) + j;
      const double shape = std::sin(std::numbers::pi * i / n) * std::sin(std::numbers::pi * j / n);
      net.set_position(id, net.position(id) + Vec3(0, far * shape, 0));
    }
  const double t = 2 * std::numbers::pi / omega;
  const int middle = n / 2 * (n + 1) + n / 2;
  for (const double share : {0.25, 0.5, 1.0}) {
    run.run_to(share * t);
    other.run_to(share * t);
    CAPTURE(share);
    const double moved = net.position(middle).y() - other.system.position(middle).y();
    CHECK(moved / far == Approx(std::cos(omega * net.t())).margin(0.02));
  }
}

namespace {

// Balls in a row, of which the first come with 1 m/s.
std::string row(int balls, double gap, bool strings, int moving = 1) {
  return "local gap, n, moving, r = " + std::to_string(gap * 1e9) + "e-9, " +
         std::to_string(balls) + ", " + std::to_string(moving) +
         ", 0.02\nlocal particles, balls, ties = sim.particles {}, {}, {}\n"
         "for i = 1, n do local x = (i - 1) * (2 * r + gap)\n"
         "  balls[i] = sim.rigid { shape = sim.sphere { radius = r }, mass = 0.25, restitution = "
         "1,\n"
         "    position = { x, 0, 0 }, velocity = { i <= moving and 1 or 0, 0, 0 } }\n" +
         (strings
              ? "  for _, z in ipairs { -1, 1 } do local hook = particles:add { x, 2, z }\n"
                "    particles:pin(hook) ties[#ties + 1] = { balls[i]:at {0, 0, 0}, hook } end\n"
              : std::string("")) +
         "end\nif #particles == 0 then particles:add { 0, 9, 0 } end\n"
         "return sim.scene { particles = particles, bodies = balls, forces = {},\n" +
         (strings ? "  constraints = { sim.constraint.distance { ties = ties } },\n" : "") +
         "  integrator = 'rk4', dt = 0.001, duration = 1 }\n";
}

}  // namespace

TEST_CASE("a push runs along a row of balls, whatever their gaps and the step", "[scenes][shown]") {
  for (const bool strings : {false, true})
    for (const int balls : {3, 5})
      for (const double gap : {0.0, 1e-9, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3})
        for (const double dt : {1e-5, 1e-4, 1e-3, 5e-3}) {
          if (dt == 1e-5 && gap > 1e-5) continue;  // as with larger steps, but long
          CAPTURE(strings, balls, gap, dt);
          TextRun run(row(balls, gap, strings), "rk4", dt);
          // The push goes through the row in the time of its gaps.
          run.run_to(dt + 1.5 * gap * balls);
          for (int i = 0; i < balls; ++i)
            CHECK(run.system.body_state(i).velocity.x() ==
                  Approx(i == balls - 1 ? 1 : 0).margin(strings ? 1e-4 : 1e-9));
          CHECK(run.system.energy().kinetic == Approx(0.5 * 0.25).epsilon(strings ? 1e-5 : 1e-9));
        }
}

TEST_CASE("as many balls leave a row as come, whatever their gaps and the step",
          "[scenes][shown]") {
  constexpr int kBalls = 5;
  for (const bool strings : {false, true})
    for (const int moving : {2, 3, 4})
      for (const double gap : {0.0, 1e-6, 1e-5, 1e-4, 1e-3})
        for (const double dt : {1e-4, 2.5e-4, 5e-4, 1e-3, 5e-3}) {
          CAPTURE(strings, moving, gap, dt);
          TextRun run(row(kBalls, gap, strings, moving), "verlet", dt);
          // The last impact is after as many gaps as there are balls between the outermost ones.
          run.run_to(dt + 1.5 * gap * kBalls);
          for (int i = 0; i < kBalls; ++i)
            CHECK(run.system.body_state(i).velocity.x() ==
                  Approx(i < kBalls - moving ? 0 : 1).margin(strings ? 2e-4 : 1e-9));
          CHECK(run.system.energy().kinetic ==
                Approx(0.5 * 0.25 * moving).epsilon(strings ? 1e-4 : 1e-9));
        }
}

TEST_CASE("cradle.lua sends off as many balls as fall", "[scenes][shown]") {
  for (const char* fall : {"1", "2"})
    for (const char* gap : {"0", "1e-6", "1e-4"}) {
      CAPTURE(fall, gap);
      SceneRun run("cradle", {{"fall", fall}, {"gap", gap}});
      const int falling = fall[0] - '0';
      const Vec3 start = run.system.body_state(0).center;
      // Half a period of a pendulum of 30 degrees: as high on the other side as they were here.
      double highest = -1, least = 1;
      while (run.system.t() < 0.75) {
        REQUIRE(run.system.step());
        const double last = run.system.body_state(4).center.y();
        highest = std::max(highest, last);
        least = std::min(least, run.system.body_state(4 - falling).center.y());
        if (last < highest - 1e-6) break;
      }
      CHECK(highest == Approx(start.y()).margin(2e-4));
      // The others hang still.
      CHECK(run.system.body_state(4 - falling).velocity.norm() < 0.05);
    }
}

TEST_CASE("torn_curtain.lua leaves no face over a gap, and every joule is booked",
          "[scenes][shown]") {
  SceneRun run("torn_curtain", {{"n", "16"}});
  run.run_to(0.8);
  CHECK(run.system.torn().size() >= 3);
  CHECK(run.system.settings().broken_energy > 0);
  // Torn pairs have no springs, all others have those that they had.
  for (const auto& [a, b] : run.system.torn())
    for (const Link& link : run.system.links(a)) CHECK(link.to != b);
  long left = 0;
  for (int i = 0; i < run.system.particles(); ++i)
    for (const Link& link : run.system.links(i)) left += link.to > i;
  CHECK(left + static_cast<long>(run.system.torn().size()) == 2 * 16 * 15 + 2 * 15 * 15);
}

TEST_CASE("bridge.lua bears what a rope bears, and no more", "[scenes][shown]") {
  // Statics: both banks carry all of the weight, and pull against each other.
  SceneRun run("bridge", {{"load", "0"}, {"planks", "11"}});
  run.run_to(10);
  CHECK(run.system.torn().empty());
  Vec3 left(0, 0, 0), right(0, 0, 0);
  for (const int i : {0, 1, 24, 25})
    for (const Link& link : run.system.links(i)) {
      const Vec3 d = run.system.position(link.to) - run.system.position(i);
      (i < 2 ? left : right) += link.tension(d.norm()) / d.norm() * d;
    }
  const double weight = 22 * 4 * gravity_of(run.spec.systems[0]);
  CHECK(left.y() + right.y() == Approx(-weight).epsilon(1e-3));
  CHECK(left.x() == Approx(-right.x()).epsilon(1e-3));
  // Moments about the middle of half of the bridge: what the bank pulls times the sag holds what it
  // bears times 6 m, less the weights at their places.
  double moment = -left.y() * 6;
  for (int plank = 1; plank <= 5; ++plank)
    moment -= 2 * 4 * gravity_of(run.spec.systems[0]) * (6 - run.system.position(2 * plank).x());
  CHECK(left.x() * -run.system.position(12).y() == Approx(moment).epsilon(1e-3));

  SceneRun held("bridge"), broken("bridge", {{"load", "2000"}});
  held.run_to(9);
  CHECK(held.system.torn().empty());
  broken.run_to(5);
  CHECK_FALSE(broken.system.torn().empty());
}

TEST_CASE("ragdoll.lua keeps limbs together and does not bend knees forward", "[scenes][shown]") {
  SceneRun run("ragdoll", {{"n", "2"}});
  const auto at = [&](int body, const Vec3& x) {
    const RigidState state = run.system.body_state(body);
    return state.center + state.axes * x;
  };
  double apart = 0, forward = -1;
  while (run.system.t() < 2) {
    REQUIRE(run.system.step());
    for (const int doll : {0, 10}) {
      apart = std::max(apart, (at(doll, {0, 0.27, 0}) - at(doll + 1, {0, -0.13, 0})).norm());
      for (const int thigh : {doll + 4, doll + 8}) {
        apart = std::max(apart, (at(thigh, {0, -0.22, 0}) - at(thigh + 1, {0, 0.22, 0})).norm());
        // How far the ankle is before the thigh's own axis.
        const Vec3 shin = at(thigh + 1, {0, -0.22, 0}) - at(thigh + 1, {0, 0.22, 0});
        const Vec3 ahead = at(thigh, {1, 0, 0}) - at(thigh, {0, 0, 0});
        forward = std::max(forward, shin.dot(ahead) / 0.44);
      }
    }
  }
  CHECK(apart < 1e-10);
  CHECK(forward < 0.5);
  CHECK(forward > -0.1);  // as they stand
  CHECK(run.system.body_state(1).center.y() < 0.5);
}

// Whether rings run through each other is told by where the center line of one crosses the disc of
// the other: once.
TEST_CASE("chain_mail.lua keeps every ring in those that it runs through", "[scenes][shown]") {
  constexpr int kSides = 60;
  const auto linked = [](const Simulation& system, int i, int j) {
    const RigidState disc = system.body_state(i), ring = system.body_state(j);
    const Vec3 normal = disc.axes.column(2);
    const auto at = [&](int k) {
      const double angle = 2 * std::numbers::pi * k / kSides;
      return ring.center - disc.center +
             0.05 * (std::cos(angle) * ring.axes.column(0) + std::sin(angle) * ring.axes.column(1));
    };
    int crossings = 0;
    for (int k = 0; k < kSides; ++k) {
      const Vec3 a = at(k), b = at(k + 1);
      const double above = a.dot(normal), below = b.dot(normal);
      if ((above > 0) != (below > 0))
        crossings += (a + above / (above - below) * (b - a)).norm() < 0.05;
    }
    return crossings % 2 == 1;
  };
  const auto links = [&](const Simulation& system) {
    std::vector<bool> list;
    for (int i = 0; i < system.bodies(); ++i)
      for (int j = i + 1; j < system.bodies(); ++j) list.push_back(linked(system, i, j));
    return list;
  };
  // Each of the 4 n rows of n has 2 n - 1 links to the next; the longer steps jam rings, and the
  // longest lead them through each other.
  for (const auto& [n, dt, time] : {std::tuple{2, 0.005, 1.0}, {3, 0.012, 0.8}, {3, 0.016, 0.8}}) {
    SceneRun run("chain_mail", {{"n", std::to_string(n)}}, "", dt);
    const std::vector<bool> start = links(run.system);
    CHECK(std::ranges::count(start, true) == (4 * n - 1) * (2 * n - 1));
    run.run_to(time);
    CHECK(links(run.system) == start);
    CHECK(run.system.body_state(0).center.y() < 0);
  }
}

// Milankovitch (1907), Theorie der Druckkurven, Z. Math. Phys. 55: a semicircular arch of loose
// stones needs a thickness of 0.1075 of its mean radius, if nothing slides.
TEST_CASE("arch.lua stands where its thickness allows a line of thrust", "[scenes][shown]") {
  for (const auto& [thickness, stands] : {std::pair{"0.11", true}, {"0.103", false}}) {
    INFO("thickness " << thickness);
    SceneRun run("arch", {{"n", "25"}, {"thickness", thickness}});
    const double start = run.system.body_state(12).center.y();
    run.run_to(0.3);
    const double sunk = start - run.system.body_state(12).center.y();
    CHECK((stands ? std::fabs(sunk) < 1e-6 : sunk > 1e-3));
  }
}
