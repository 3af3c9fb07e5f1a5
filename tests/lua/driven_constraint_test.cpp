// The work of constraints that move, and of hands on particles under constraints, is in the
// balance.
#include <cmath>

#include "core/session/replay.h"
#include "core/study/energy_balance.h"
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

// A pendulum of rods whose first particle goes as `constraint` says.
std::string pendulum(const std::string& constraint) {
  return "local p = sim.particles { mass = 0.4 }\n"
         "p:add {1, 0, 0}\np:add {1.4, -0.3, 0.1}\np:add {1.5, -0.7, 0.3}\n"
         "local function swing(t) return {0.3*math.sin(5*t), 0.1*math.cos(3*t) - 0.1, 0} end\n"
         "return sim.scene { particles = p, forces = { sim.force.gravity { g = {0, -9.81, 0} } },\n"
         "constraints = { " +
         constraint +
         "sim.constraint.distance { ties = { {0, 1}, {1, 2} } } },\n"
         "integrator = 'rk4', dt = 0.01, duration = 1 }\n";
}

// The largest deviation of E + W from its start in 1 s with step h, and the largest supplied work,
// J.
struct Balance {
  double off = 0, given = 0;
};

Balance run(const SceneSpec& spec, Registry& registry, double h, const std::string& hands) {
  Simulation system(spec.systems[0], registry, {.integrator = MethodChoice{"rk4"}, .dt = h});
  study::EnergyBalance balance(system);
  double start = system.energy().total();
  const Recording all = parse_recording(hands, "hands");
  const auto found = all.systems.find("");
  Replay replay(found == all.systems.end() ? RecordedSystem{}.actions : found->second.actions);
  Balance result;
  while (system.t() < 1 - 0.5 * h) {
    if (const auto change = replay.perform(system)) {
      balance.touched(*change);
      start += *change;
    }
    REQUIRE(system.step());
    balance.advance();
    balance.look();
    result.off = std::max(result.off, std::fabs(system.energy().total() + balance.taken() - start));
    result.given = std::max(result.given, std::fabs(balance.taken()));
  }
  return result;
}

}  // namespace

TEST_CASE("the work of constraints that move is in the balance of energy", "[lua][constraint]") {
  Registry registry({SIM_PLUGIN_DIR});
  for (const std::string constraint :
       {"sim.constraint.on_sphere { particles = {0}, center = swing, radius = 1 }, ",
        "sim.constraint.on_plane { particles = {0}, point = swing, normal = {0.6, 0.8, 0} }, ",
        "sim.constraint.on_circle { particles = {0}, center = swing, radius = 1, axis = {0, 0, 1} "
        "}, "}) {
    const SceneSpec spec = load_text(pendulum(constraint));
    const Balance coarse = run(spec, registry, 0.004, ""), fine = run(spec, registry, 0.002, "");
    INFO(constraint << coarse.off << " and " << fine.off << " of " << coarse.given << " J");
    CHECK(coarse.given > 0.1);
    CHECK(coarse.off < 1e-4 * coarse.given);
    CHECK(fine.off < 0.5 * coarse.off);
  }
}

TEST_CASE("the work of a hand on rods is in the balance of energy", "[lua][constraint]") {
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec spec = load_text(
      pendulum("sim.constraint.on_sphere { particles = {0}, center = swing, radius = 1 }, "));
  double before = 0;
  for (const int finer : {1, 2}) {
    const auto steps = [&](int n) { return std::to_string(n * finer); };
    const std::string hands = "+" + steps(20) + " grab 2\n+0 move 2 1.3 -0.8 0.1 over " +
                              steps(100) + "\n+" + steps(110) + " release 2\n+" + steps(100) +
                              " pin 2\n";
    const Balance all = run(spec, registry, 0.004 / finer, hands);
    INFO(finer << ": off by " << all.off << " of " << all.given << " J");
    CHECK(all.given > 0.1);
    CHECK(all.off < 2e-3 * all.given);
    if (before > 0) CHECK(all.off < 0.6 * before);
    before = all.off;
  }
}

// Two moments a step of rk4, with nine places each, and the start.
TEST_CASE("a function that moves a hoop is called a few times a step", "[lua][constraint]") {
  const SceneSpec spec = load_text(
      "local calls = 0\nlocal p = sim.particles { mass = 1 }\np:add {1, 0, 0}\n"
      "return sim.scene { particles = p, forces = { sim.force.gravity {} },\n"
      "constraints = { sim.constraint.on_circle { particles = {0}, radius = 1,\n"
      "  axis = function(t) calls = calls + 1 return {math.sin(t), 0, math.cos(t)} end } },\n"
      "observe = { calls = function() return calls end },\n"
      "integrator = 'rk4', dt = 0.01, duration = 1 }\n");
  Registry registry({SIM_PLUGIN_DIR});
  Simulation system(spec.systems[0], registry, {});
  const auto calls = [&] { return spec.systems[0].observers[0].value(system); };
  const double before = calls();
  for (int step = 0; step < 10; ++step) REQUIRE(system.step());
  CHECK(calls() - before <= 10 * 3 * 9);
  CHECK(calls() - before >= 10 * 9);
}
