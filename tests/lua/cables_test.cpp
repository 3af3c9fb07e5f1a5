// Springs that pull alone, that push alone, and that break.
#include <cmath>
#include <set>

#include "core/scene/simulation.h"
#include "core/session/action.h"
#include "core/session/checkpoint.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kG = 9.81, kK = 400, kMass = 1;  // m/s^2, N/m, kg

// A bead at the end of a cable of 1 m, thrown upwards with 1 m/s, or with `sign` -1 a bead on a
// strut below it, upside down.
std::string bead(int sign, const std::string& more = "") {
  const std::string s = sign > 0 ? "-" : "";
  return "local particles = sim.particles { mass = 1 }\n"
         "particles:add {0, 0, 0}\n"
         "particles:add({0, -1, 0}, { velocity = {0, 1, 0} })\n"
         "particles:pin(0)\n"
         "local cable = sim.force.spring { stiffness = 400, rest = 1, " +
         std::string(sign > 0 ? "tension_only" : "compression_only") + " = true" + more +
         ", ties = { {0, 1} } }\n"
         "local forces = { sim.force.gravity { g = {0, " +
         s + "9.81, 0} }, cable }\n" + kEnd;
}

// y of the bead: a throw until it is back at -1, then a sine about the rest of the hanging bead.
double bead_at(double t) {
  const double back = 2 / kG;
  if (t < back) return -1 + t - 0.5 * kG * t * t;
  const double omega = std::sqrt(kK / kMass), sag = kMass * kG / kK, s = t - back;
  return -1 - sag + sag * std::cos(omega * s) - std::sin(omega * s) / omega;
}

// Half a turn of the sine and somewhat less: the cable is taut all the time.
constexpr double kTaut = 2 / kG + 0.12;

}  // namespace

TEST_CASE("a cable lets a bead fly while it is slack", "[cables]") {
  for (const char* method : {"rk4", "verlet", "yoshida4", "implicit_midpoint", "trbdf2", "bdf2"}) {
    CAPTURE(method);
    TextRun run(bead(1), method, 1e-4);
    run.run_to(0.1);
    CHECK(run.system.position(1).y() == Approx(bead_at(run.system.t())).epsilon(1e-8));
    run.run_to(kTaut);
    CHECK(run.system.position(1).y() == Approx(bead_at(run.system.t())).epsilon(1e-5));
  }
}

TEST_CASE("implicit methods hold a cable with large steps", "[cables]") {
  // Ten times the bead's period in a step: implicit Euler comes to rest where the bead hangs.
  TextRun run(bead(1), "implicit_euler", 0.1);
  run.run_to(20);
  CHECK(run.system.position(1).y() == Approx(-1 - kMass * kG / kK).epsilon(1e-7));
}

TEST_CASE("a strut lets a bead go and pushes it back", "[cables]") {
  // The strut is the cable with gravity upwards: the bead moves by the same law to the other side.
  TextRun run(bead(-1), "rk4", 1e-4);
  run.run_to(0.1);
  // Pressed by its throw towards the hook, about the equilibrium at -1 + m g / k.
  const double omega = std::sqrt(kK / kMass), push = kMass * kG / kK, t = run.system.t();
  CHECK(run.system.position(1).y() ==
        Approx(-1 + push - push * std::cos(omega * t) + std::sin(omega * t) / omega).epsilon(1e-6));
}

TEST_CASE("the strain of a slack cable is told, and no force", "[cables]") {
  TextRun run(bead(1), "rk4", 1e-3);
  run.run_to(0.1);
  const std::vector<Link> links = run.system.links(1);
  REQUIRE(links.size() == 1);
  const double length = run.system.position(1).norm();
  CHECK(length < 1);
  CHECK(links[0].sense == SpringSense::kTension);
  CHECK(links[0].tension(length) == 0);
  CHECK(links[0].tension(1.5) == 200);
  for (const ForceShare& share : run.system.forces_on(1))
    if (share.name == "spring") CHECK(share.force.norm() == 0);
  CHECK(run.system.energy().potential == Approx(kMass * kG * run.system.position(1).y()));
}

TEST_CASE("a damped cable does not brake while it is slack", "[cables]") {
  // From a little above, where the cable is slack already.
  const auto slack = [](std::string text) {
    return text.replace(text.find("{0, -1, 0}"), 10, "{0, -0.999, 0}");
  };
  TextRun damped(slack(bead(1, ", damping = 5")), "rk4", 1e-3), free(slack(bead(1)), "rk4", 1e-3);
  damped.run_to(0.15);
  free.run_to(0.15);
  CHECK(damped.system.position(1).y() == Approx(free.system.position(1).y()).epsilon(1e-14));
  damped.run_to(20);
  CHECK(damped.system.position(1).y() == Approx(-1 - kMass * kG / kK).epsilon(1e-4));
}

TEST_CASE("a spring that may neither pull nor push is refused", "[cables]") {
  CHECK(contains(said(bead(1, ", compression_only = true")), "neither pull nor push"));
}

TEST_CASE("nets of cables in large numbers are those of a few", "[cables]") {
  // Once as a grid, in runs, and once with ids mixed up, in a net; both implicit and explicit.
  const auto scene = [](bool mixed) {
    return std::string("local n, id = 20, {}\nlocal particles = sim.particles { mass = 0.01 }\n") +
           "for k = 0, n * n - 1 do local c = " + (mixed ? "k * 147 % (n * n)" : "k") +
           "\n  id[c] = particles:add {c // n * 0.1, 0.02 * math.sin(c), c % n * 0.1} end\n"
           "particles:pin(id[0], id[n - 1])\n"
           "local net = sim.force.spring { stiffness = 50, rest = 0.1, tension_only = true }\n"
           "for i = 0, n - 1 do for j = 0, n - 1 do local c = i * n + j\n"
           "  if i < n - 1 then net:tie(id[c], id[c + n]) end\n"
           "  if j < n - 1 then net:tie(id[c], id[c + 1]) end\nend end\n"
           "local forces = { sim.force.gravity {}, net }\n" +
           kEnd;
  };
  for (const char* method : {"rk4", "verlet", "implicit_midpoint"}) {
    CAPTURE(method);
    TextRun grid(scene(false), method, 1e-3), mixed(scene(true), method, 1e-3);
    grid.run_to(0.2);
    mixed.run_to(0.2);
    double most = 0;
    for (int k = 0; k < 400; ++k)
      most =
          std::max(most, (grid.system.position(k * 147 % 400) - mixed.system.position(k)).norm());
    CHECK(most < (std::string(method) == "implicit_midpoint" ? 1e-5 : 1e-10));
  }
}

TEST_CASE("a spring breaks where it is pulled too far, and what was in it is booked",
          "[breaking]") {
  // A bead pulled out to where the sine about its rest comes 0.2 m down: it breaks at 0.1.
  const std::string text =
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add {0, 0, 0}\n"
      "particles:add({1, 0, 0}, { velocity = {4, 0, 0} })\n"
      "particles:pin(0)\n"
      "local forces = { sim.force.spring { stiffness = 400, rest = 1, break_strain = 0.1,\n"
      "  ties = { {0, 1} } } }\n" +
      kEnd;
  for (const char* method : {"rk4", "verlet", "implicit_midpoint", "dopri5"}) {
    CAPTURE(method);
    TextRun run(text, method, 1e-3);
    const double omega = 20, amplitude = 4 / omega;
    const double broke = std::asin(0.1 / amplitude) / omega;
    const auto step = static_cast<std::int64_t>(broke / 1e-3) + 1;
    while (run.system.step_count() < step) {
      CHECK(run.system.torn().empty());
      REQUIRE(run.system.step());
    }
    REQUIRE(run.system.torn().size() == 1);
    CHECK(run.system.torn()[0] == std::array<int, 2>{0, 1});
    CHECK(run.system.links(0).empty());
    const double t = run.system.t(), x = 1 + amplitude * std::sin(omega * t),
                 v = 4 * std::cos(omega * t);
    CHECK(run.system.settings().broken_energy ==
          Approx(0.5 * 400 * (x - 1) * (x - 1)).epsilon(1e-3));
    // Free from then on.
    run.run_to(0.5);
    CHECK(run.system.position(1).x() == Approx(x + v * (run.system.t() - t)).epsilon(1e-4));
    CHECK(run.system.energy().total() + run.system.settings().broken_energy ==
          Approx(8).epsilon(1e-4));
  }
}

namespace {

// A sheet of 8 x 8 on two corners, with weak threads, that is pulled down.
const std::string kSheet =
    "local particles = sim.grid { 8, 8, du = {0, -0.1, 0}, dv = {0.1, 0, 0}, mass = 0.05 }\n"
    "particles:pin(0, 7)\n"
    "local forces = { sim.force.gravity { g = {0, -30, 0} },\n"
    "  sim.force.spring { stiffness = 60, grid = particles, break_strain = 0.35,\n"
    "    offsets = { {0, 1}, {1, 0}, {1, 1}, {1, -1} } } }\n" +
    kEnd;

struct Thread {
  int a, b;
  double rest;
  bool broken = false;
};

}  // namespace

TEST_CASE("a sheet tears as in a plain loop", "[breaking]") {
  constexpr int n = 8;
  constexpr double h = 5e-4, k = 60, mass = 0.05;
  std::vector<Thread> threads;
  for (const auto& [di, dj] : {std::pair{0, 1}, {1, 0}, {1, 1}, {1, -1}})
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        if (i + di >= n || j + dj < 0 || j + dj >= n) continue;
        threads.push_back({i * n + j, (i + di) * n + j + dj, 0.1 * std::hypot(di, dj)});
      }
  std::vector<Vec3> x, v(n * n, Vec3(0, 0, 0));
  for (int i = 0; i < n * n; ++i) x.push_back({0.1 * (i % n), -0.1 * (i / n), 0});
  TextRun run(kSheet, "symplectic_euler", h);
  std::size_t most = 0;
  for (int step = 0; step < 1200; ++step) {
    std::vector<Vec3> f(n * n, Vec3(0, -30 * mass, 0));
    for (const Thread& t : threads) {
      if (t.broken) continue;
      const Vec3 d = x[static_cast<std::size_t>(t.a)] - x[static_cast<std::size_t>(t.b)];
      const Vec3 pull = -k * (d.norm() - t.rest) / d.norm() * d;
      f[static_cast<std::size_t>(t.a)] += pull;
      f[static_cast<std::size_t>(t.b)] -= pull;
    }
    for (int i = 0; i < n * n; ++i) {
      if (i == 0 || i == 7) continue;
      const auto at = static_cast<std::size_t>(i);
      v[at] += h / mass * f[at];
      x[at] += h * v[at];
    }
    std::set<std::array<int, 2>> torn;
    for (Thread& t : threads) {
      const Vec3 d = x[static_cast<std::size_t>(t.a)] - x[static_cast<std::size_t>(t.b)];
      t.broken = t.broken || d.norm() > 1.35 * t.rest;
      if (t.broken) torn.insert({std::min(t.a, t.b), std::max(t.a, t.b)});
    }
    REQUIRE(run.system.step());
    const std::vector<std::array<int, 2>> list(torn.begin(), torn.end());
    REQUIRE(std::ranges::equal(run.system.torn(), list));
    most = std::max(most, torn.size());
  }
  CHECK(most > 5);
  CHECK(most < threads.size());
}

TEST_CASE("what breaks does not depend on threads, and comes back with the state", "[breaking]") {
  TextRun one(kSheet, "rk4", 1e-3), three(kSheet, "rk4", 1e-3, 3);
  while (one.system.torn().empty()) REQUIRE(one.system.step());
  const Snapshot middle = one.system.snapshot();
  const std::size_t then = one.system.torn().size();
  const std::string bytes =
      encode({"sheet", {}, 0, {checkpoint(one.system, one.spec.systems[0], 0)}});
  one.run_to(0.6);
  three.run_to(0.6);
  const std::uint64_t hash = one.system.hash();
  const std::vector<int> broken = one.system.settings().broken;
  CHECK(broken.size() > then);
  CHECK(three.system.hash() == hash);
  CHECK(three.system.settings().broken == broken);

  one.system.restore(middle);
  CHECK(one.system.torn().size() == then);
  one.run_to(0.6);
  CHECK(one.system.hash() == hash);
  CHECK(one.system.settings().broken == broken);

  TextRun other(kSheet, "rk4", 1e-3);
  resume(other.system, other.spec.systems[0], decode(bytes, "sheet").systems[0], other.registry);
  CHECK(other.system.torn().size() == then);
  other.run_to(0.6);
  CHECK(other.system.hash() == hash);
  CHECK(other.system.settings().broken_energy == one.system.settings().broken_energy);

  one.system.reset();
  CHECK(one.system.torn().empty());
  one.run_to(0.6);
  CHECK(one.system.hash() == hash);
}

TEST_CASE("ties of formulas break as springs do", "[breaking]") {
  std::string formula = kSheet;
  const std::size_t at = formula.find("sim.force.spring { stiffness = 60,");
  formula.replace(at, std::string("sim.force.spring { stiffness = 60,").size(),
                  "sim.force.expression { '0.5*k*(r - rest)^2', k = 60,");
  TextRun springs(kSheet, "verlet", 1e-3), formulas(formula, "verlet", 1e-3);
  springs.run_to(0.6);
  formulas.run_to(0.6);
  CHECK(springs.system.torn().size() > 5);
  CHECK(std::ranges::equal(springs.system.torn(), formulas.system.torn()));
  CHECK(formulas.system.settings().broken_energy ==
        Approx(springs.system.settings().broken_energy).epsilon(1e-9));
}

TEST_CASE("ties that may break are cut by hand, others not", "[breaking]") {
  TextRun run(kSheet, "rk4", 1e-3);
  apply(run.system, parse_action("cut 9 8"));
  CHECK(std::ranges::equal(run.system.torn(), std::vector<std::array<int, 2>>{{8, 9}}));
  CHECK_THROWS_AS(run.system.cut(9, 8), Error);
  CHECK_THROWS_AS(run.system.cut(0, 63), Error);
  TextRun bead_run(bead(1), "rk4", 1e-3);
  CHECK_THROWS_AS(bead_run.system.cut(0, 1), Error);
}
