// Rods that break, and what goes with a tear: springs that bridge it, and bending across it.
#include <cmath>
#include <random>
#include <set>

#include "core/scene/simulation.h"
#include "core/session/checkpoint.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kG = 9.81;

// The rest of a scene that has constraints, too.
const std::string kRodsEnd =
    "return sim.scene { particles = particles, forces = forces, constraints = constraints,\n"
    "  integrator = \"rk4\", dt = 0.01, duration = 1 }\n";

// A bead of 1 kg on a rod of 1 m, released where the rod is level.
std::string swing(const std::string& limit) {
  return "local particles = sim.particles { mass = 1 }\n"
         "particles:add {0, 0, 0}\n"
         "particles:add {1, 0, 0}\n"
         "particles:pin(0)\n"
         "local constraints = { sim.constraint.distance { ties = { {0, 1} }, " +
         limit +
         " } }\n"
         "local forces = { sim.force.gravity {} }\n" +
         kRodsEnd;
}

}  // namespace

TEST_CASE("a rod breaks where its tension is more than it bears", "[breaking]") {
  // The tension of a pendulum that was released level is 3 m g sin(phi), phi below the level.
  for (const char* method : {"rk4", "verlet", "yoshida4", "implicit_midpoint", "dopri5"}) {
    CAPTURE(method);
    constexpr double h = 1e-3;
    TextRun run(swing("break_force = 2 * 9.81"), method, h);
    double sine = 0;
    while (run.system.torn().empty()) {
      sine = -run.system.position(1).y();
      REQUIRE(run.system.t() < 0.6);
      REQUIRE(run.system.step());
    }
    CHECK(sine <= 2.0 / 3 + 1e-6);
    CHECK(-run.system.position(1).y() > 2.0 / 3 - 1e-6);
    CHECK(run.system.torn()[0] == std::array<int, 2>{0, 1});
    CHECK(run.system.settings().broken_energy == 0);
    // A throw from then on, with the speed sqrt(2 g sin(phi)).
    const Vec3 x = run.system.position(1), v = run.system.velocity(1);
    CHECK(v.norm() == Approx(std::sqrt(-2 * kG * x.y())).epsilon(1e-4));
    const double begin = run.system.t();
    run.run_to(1);
    const double t = run.system.t() - begin;
    CHECK(run.system.position(1).x() == Approx(x.x() + v.x() * t).epsilon(1e-9));
    CHECK(run.system.position(1).y() == Approx(x.y() + v.y() * t - 0.5 * kG * t * t).epsilon(1e-9));
  }
}

TEST_CASE("a rod that bears more does not break, nor by a strain that it never has", "[breaking]") {
  for (const char* limit : {"break_force = 3.01 * 9.81", "break_strain = 0.01"}) {
    CAPTURE(limit);
    TextRun whole(swing(limit), "rk4", 1e-3), plain(swing("length = 1"), "rk4", 1e-3);
    whole.run_to(1);
    plain.run_to(1);
    CHECK(whole.system.torn().empty());
    CHECK(whole.system.hash() == plain.system.hash());
  }
}

TEST_CASE("of a hanging chain the rod breaks that bears too much", "[breaking]") {
  // Rod k of 5, from above, bears 5 - k beads of 1 kg.
  TextRun run(
      "local particles = sim.particles { mass = 1 }\n"
      "for k = 0, 5 do particles:add {0, -k, 0} end\n"
      "particles:pin(0)\n"
      "local rods = sim.constraint.distance { break_force = 45 }\n"
      "for k = 0, 4 do rods:tie(k, k + 1) end\n"
      "local constraints = { rods }\n"
      "local forces = { sim.force.gravity {} }\n" +
          kRodsEnd,
      "verlet", 1e-3);
  REQUIRE(run.system.step());
  CHECK(run.system.settings().broken == std::vector<int>{0});
  const double begin = run.system.t();
  run.run_to(0.5);
  CHECK(run.system.settings().broken == std::vector<int>{0});
  const double t = run.system.t() - begin;
  for (int k = 1; k <= 5; ++k)
    CHECK(run.system.position(k).y() == Approx(-k - 0.5 * kG * t * t).epsilon(1e-9));
}

TEST_CASE("limits of single rods, and the last rod of a scene", "[breaking]") {
  TextRun run(
      "local particles = sim.particles { mass = 1 }\n"
      "for k = 0, 2 do particles:add {0, -k, 0} end\n"
      "particles:pin(0)\n"
      "local rods = sim.constraint.distance { break_force = 100 }\n"
      "rods:tie(0, 1)\n"
      "rods:tie(1, 2, { break_force = 5 })\n"
      "local constraints = { rods }\n"
      "local forces = { sim.force.gravity {} }\n" +
          kRodsEnd,
      "rk4", 1e-3);
  REQUIRE(run.system.step());
  CHECK(run.system.settings().broken == std::vector<int>{1});
  run.system.cut(1, 0);
  CHECK(run.system.settings().broken == std::vector<int>{0, 1});
  const double begin = run.system.t();
  run.run_to(0.3);
  const double t = run.system.t() - begin;
  CHECK(run.system.position(1).y() == Approx(-1 - 0.5 * kG * t * t).epsilon(1e-6));
}

namespace {

// A net of rods that hangs from two opposite corners, and tears.
const std::string kNet =
    "local particles = sim.grid { 5, 5, du = {0.1, 0, 0}, dv = {0, 0, 0.1}, mass = 0.02 }\n"
    "particles:pin(0, 24)\n"
    "local constraints = { sim.constraint.distance { grid = particles,\n"
    "  offsets = { {0, 1}, {1, 0} }, break_force = 4 } }\n"
    "local forces = { sim.force.gravity { g = {1, -20, 0.5} } }\n" +
    kRodsEnd;

}  // namespace

TEST_CASE("rods that broke come back with the state", "[breaking]") {
  for (const char* method : {"rk4", "verlet", "dopri5"}) {
    CAPTURE(method);
    TextRun one(kNet, method, 1e-3), three(kNet, method, 1e-3, 3);
    while (one.system.torn().empty()) {
      REQUIRE(one.system.t() < 1);
      REQUIRE(one.system.step());
    }
    const Snapshot middle = one.system.snapshot();
    const std::size_t then = one.system.torn().size();
    const std::string bytes =
        encode({"net", {}, 0, {checkpoint(one.system, one.spec.systems[0], 0)}});
    one.run_to(1);
    three.run_to(1);
    const std::uint64_t hash = one.system.hash();
    const std::vector<int> broken = one.system.settings().broken;
    CHECK(broken.size() > then);
    CHECK(three.system.hash() == hash);

    one.system.restore(middle);
    CHECK(one.system.torn().size() == then);
    one.run_to(1);
    CHECK(one.system.hash() == hash);
    CHECK(one.system.settings().broken == broken);

    TextRun other(kNet, method, 1e-3);
    resume(other.system, other.spec.systems[0], decode(bytes, "net").systems[0], other.registry);
    other.run_to(1);
    CHECK(other.system.hash() == hash);

    one.system.reset();
    CHECK(one.system.torn().empty());
    one.run_to(1);
    CHECK(one.system.hash() == hash);
  }
}

// Springs and dashpots, which may be slack: what comes back is as strong as it was.
TEST_CASE("springs that broke come back with the state, with their damping", "[breaking]") {
  for (const char* sense : {"", ", tension_only = true", ", compression_only = true"}) {
    CAPTURE(sense);
    // Three beads in a row fly apart, or together, in turn; each spring has numbers of its own.
    const std::string text =
        "local particles = sim.particles { mass = 1 }\n"
        "for i = 0, 3 do particles:add({ i, 0, 0 }, { velocity = { i % 2 == 0 and -4 or 4, 0, 0 } "
        "}) "
        "end\n"
        "local springs = sim.force.spring { damping = 3, break_strain = 0.2" +
        std::string(sense) +
        " }\n"
        "for i = 0, 2 do springs:tie(i, i + 1, { stiffness = 20 + i, rest = 0.9 + 0.1 * i }) end\n"
        "local forces = { springs }\n" +
        kEnd;
    TextRun run(text, "rk4", 1e-3);
    const Snapshot begin = run.system.snapshot();
    run.run_to(0.005);
    REQUIRE(run.system.torn().empty());
    const std::uint64_t hash = run.system.hash();
    while (run.system.torn().empty()) {
      REQUIRE(run.system.t() < 5);
      REQUIRE(run.system.step());
    }
    run.system.restore(begin);
    REQUIRE(run.system.torn().empty());
    run.run_to(0.005);
    CHECK(run.system.hash() == hash);
  }
}

TEST_CASE("a rod to a point of a body breaks", "[breaking]") {
  TextRun run(
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add {0, 0, 0}\n"
      "particles:pin(0)\n"
      "local box = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} }, mass = 2,\n"
      "  position = {0, -1.1, 0} }\n"
      "local rods = sim.constraint.distance { break_force = 15 }\n"
      "rods:tie(0, box:at {0, 0.1, 0})\n"
      "return sim.scene { particles = particles, forces = { sim.force.gravity {} },\n"
      "  constraints = { rods }, bodies = { box }, integrator = 'rk4', dt = 0.01,\n"
      "  duration = 1 }\n",
      "rk4", 1e-3);
  REQUIRE(run.system.step());
  CHECK(run.system.settings().broken == std::vector<int>{0});
  const double begin = run.system.t();
  run.run_to(0.5);
  const double t = run.system.t() - begin;
  CHECK(run.system.body_state(0).center.y() == Approx(-1.1 - 0.5 * kG * t * t).epsilon(1e-6));
}

TEST_CASE("springs that bridge a tear go with it", "[breaking]") {
  // Three beads in a row; the springs to the second next one have no limit of their own.
  for (const bool formula : {false, true}) {
    CAPTURE(formula);
    const std::string flex = formula ? "sim.force.expression { '0.5*k*(r - rest)^2', k = 50,"
                                     : "sim.force.spring { stiffness = 50,";
    TextRun run(
        "local particles = sim.grid { 4, 1, du = {1, 0, 0}, dv = {0, 1, 0}, mass = 1 }\n"
        "particles:pin(0)\n"
        "local forces = { sim.force.spring { stiffness = 400, break_strain = 0.1,\n"
        "  grid = particles, offsets = { {1, 0} } },\n" +
            flex + " grid = particles, offsets = { {2, 0} } } }\n" + kEnd,
        "rk4", 1e-4);
    run.system.set_velocity(3, {3, 0, 0});
    const double energy = run.system.energy().total();
    while (run.system.torn().empty()) {
      REQUIRE(run.system.t() < 1);
      REQUIRE(run.system.step());
    }
    // The last spring breaks; the bridge over it, from 1 to 3, goes, that from 0 to 2 stays.
    CHECK(std::ranges::equal(run.system.torn(), std::vector<std::array<int, 2>>{{1, 3}, {2, 3}}));
    CHECK(run.system.settings().broken.size() == 2);
    CHECK(run.system.energy().total() + run.system.settings().broken_energy ==
          Approx(energy).epsilon(1e-8));
    const Vec3 v = run.system.velocity(3);
    run.run_to(0.5);
    CHECK(run.system.velocity(3) == v);
  }
}

// A pair is torn once all its own ties are gone, of which some cannot be cut: counted by plain
// loops over random nets in which particles share many ties.
TEST_CASE("a pair is torn when nothing joins its own two ends any more", "[breaking]") {
  constexpr int kParticles = 6;
  using Pair = std::array<int, 2>;
  std::mt19937 random(7);
  int kept = 0, gone = 0;
  for (int trial = 0; trial < 12; ++trial) {
    // Two forces of ties that break, and springs and rods that do not.
    std::vector<Pair> ties[4];
    std::string lists[4];
    for (int a = 0; a < kParticles; ++a)
      for (int b = a + 1; b < kParticles; ++b)
        for (const int kind : {0, 1, 2, 3})
          if (random() % (kind == 3 ? 8 : 3) == 0) {
            const bool turned = random() % 2 == 0;
            ties[kind].push_back({a, b});
            lists[kind] += "{" + std::to_string(turned ? b : a) + ", " +
                           std::to_string(turned ? a : b) + "}, ";
          }
    if (std::ranges::any_of(ties, [](const auto& list) { return list.empty(); })) continue;
    std::string text = "local particles = sim.particles { mass = 1 }\n";
    for (int i = 0; i < kParticles; ++i)
      text += "particles:add {" + std::to_string(i) + ", " + std::to_string(i * i % 5) + ", " +
              std::to_string(i % 3) + "}\n";
    text += "local forces = { sim.force.spring { stiffness = 1, break_strain = 9, ties = {" +
            lists[0] + "} }, sim.force.spring { stiffness = 2, break_force = 1e9, ties = {" +
            lists[1] + "} }, sim.force.spring { stiffness = 3, ties = {" + lists[2] +
            "} } }\nlocal constraints = { sim.constraint.distance { ties = {" + lists[3] +
            "} } }\n";
    TextRun run(text + kRodsEnd, "rk4", 1e-3);
    std::set<Pair> cut, torn;
    for (const int kind : {0, 1})
      for (const Pair& pair : ties[kind]) {
        if (!cut.insert(pair).second) continue;  // both forces have it
        run.system.cut(pair[0], pair[1]);
        const auto joins = [&](const std::vector<Pair>& list) {
          return std::ranges::count(list, pair) > 0;
        };
        if (!joins(ties[2]) && !joins(ties[3])) torn.insert(pair);
        CHECK(std::ranges::equal(run.system.torn(), torn));
      }
    CHECK(run.system.settings().broken.size() == ties[0].size() + ties[1].size());
    gone += static_cast<int>(torn.size());
    kept += static_cast<int>(cut.size() - torn.size());
  }
  CHECK((gone > 20 && kept > 20));
}

TEST_CASE("bending goes with the faces of a tear, and is booked", "[breaking]") {
  // A strip of three faces, folded at the start: 0 1 2, 2 1 3, 2 3 4.
  const std::string strip =
      "local particles = sim.particles { mass = 1 }\n"
      "for _, x in ipairs { {0, 0, 0}, {1, 0, 0.3}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0.2} } do\n"
      "  particles:add(x) end\n"
      "local sheet = sim.surface { particles = particles,\n"
      "  triangles = { {0, 1, 2}, {2, 1, 3}, {2, 3, 4} } }\n"
      "local edges = sim.force.spring { stiffness = 100, break_strain = 0.1 }\n"
      "for _, e in ipairs { {0,1}, {0,2}, {1,2}, {1,3}, {2,3}, {2,4}, {3,4} } do\n"
      "  edges:tie(e[1], e[2]) end\n"
      "local forces = { sim.force.bending { surface = sheet, stiffness = 3 }, edges }\n" +
      kEnd;
  const auto bending_on = [](const TextRun& run, int i) {
    for (const ForceShare& share : run.system.forces_on(i))
      if (share.name == "bending") return share.force.norm();
    return 0.0;
  };
  for (const char* method : {"rk4", "implicit_midpoint"}) {
    CAPTURE(method);
    TextRun run(strip, method, 1e-4);
    CHECK(bending_on(run, 0) > 0);
    run.system.cut(0, 1);  // the first face is gone, the others bend across 2-3 alone
    CHECK(bending_on(run, 0) == 0);
    CHECK(bending_on(run, 1) > 0);
    run.system.cut(3, 4);
    for (int i = 0; i < 5; ++i) CHECK(bending_on(run, i) == 0);

    // A tie that breaks by itself takes the bending of its face along, and energies add up.
    run.system.reset();
    CHECK(bending_on(run, 0) > 0);
    run.system.set_velocity(4, {0, 4, 0});
    const double energy = run.system.energy().total();
    while (run.system.torn().empty()) {
      REQUIRE(run.system.t() < 1);
      REQUIRE(run.system.step());
    }
    CHECK(bending_on(run, 4) == 0);
    CHECK(bending_on(run, 0) > 0);
    CHECK(run.system.energy().total() + run.system.settings().broken_energy ==
          Approx(energy).epsilon(1e-7));
    run.run_to(0.3);
    CHECK(run.system.energy().total() + run.system.settings().broken_energy ==
          Approx(energy).epsilon(1e-6));
  }
}
