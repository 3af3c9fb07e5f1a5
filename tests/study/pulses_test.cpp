#include "core/study/verdict/pulses.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/scene/simulation.h"
#include "tests/lua/scene_text.h"
#include "tests/study/judged_run.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::Trust;

namespace {

// The shortest pulse of a force along x beside gravity, within 6 s, s.
double shortest(const std::string& force) {
  sim::SystemSpec spec = make_falling(1, 0);
  if (!force.empty()) spec.forces.push_back(make_part("expression", {{"fx", force}}));
  sim::Registry registry = make_registry();
  sim::Simulation run(spec, registry, {.integrator = "rk4", .dt = 0.5});
  return sim::study::shortest_pulse(run, 6);
}

}  // namespace

TEST_CASE("the shortest pulse of a force is found", "[study][verdict]") {
  const std::string long_one = "100*step(t - 1)*step(1.5 - t)";
  const double found = shortest(long_one + " - 100*step(t - 3.1)*step(3.11 - t)");
  CHECK(found > 0.0099);
  CHECK(found < 0.0101);
  CHECK(std::abs(shortest(long_one) - 0.5) < 1e-3);
  // Shorter than two samples.
  const double spike = shortest("1e5*step(t - 3.1)*step(3.1004 - t)");
  CHECK(spike > 3.9e-4);
  CHECK(spike < 4.1e-4);
}

TEST_CASE("forces that last, or change as fast as they are large, are no pulses",
          "[study][verdict]") {
  for (const char* force : {"", "100", "100*sin(50*t)", "20*step(t - 3)"}) {
    INFO(force);
    CHECK(std::isinf(shortest(force)));
  }
}

TEST_CASE("a pulse that no step has seen is found, one that was seen is not complained of") {
  const auto pulse = [](double width) {
    return make_field({0.1, 0}, [width](double t, std::span<const double> x, std::span<double> d) {
      const double s = (t - 2.503) / width;
      d[0] = x[1];
      d[1] = -x[0] + (s > 0 && s < 1 ? 30 / width * s * s * (1 - s) * (1 - s) : 0);
    });
  };
  const Judged missed = judged(pulse(1e-3), {.integrator = "rk4", .dt = 0.02}, 300);
  CHECK(missed.verdict.trust == Trust::kSuspect);
  CHECK(missed.deviation.missed_at == Approx(2.5035).margin(1e-3));
  const Judged seen = judged(pulse(0.5), {.integrator = "rk4", .dt = 0.005}, 1200);
  INFO(seen.verdict.reason);
  CHECK(seen.verdict.trust == Trust::kTrusted);
}

// A spring draws a mass after a target that moves for a while. Steps near their limit are as wrong
// as if they had not felt it.
// A hook that jerks for 0.7 ms, and a ball that leaps out for as long, between steps of 10 ms; and
// both as slow as steps can follow.
TEST_CASE("a given motion that no step has seen is found, one that was seen is not complained of") {
  const std::string led =
      "local w = sim.arg(\"w\", 1e-4, \"s\")\n"
      "local far = sim.arg(\"far\", 20, \"m\")\n"
      "local p = sim.particles { mass = 1 }\nlocal a, b = p:add {0, 0, 0}, p:add {1, 0, 0}\n"
      "p:prescribe(a, function(t) return {far*\n"
      "  math.exp(-((t - 2.0013)/w)^2), 0, 0} end)\n"
      "return sim.scene { particles = p, forces = { sim.force.spring { stiffness = 100, rest = 1,\n"
      "  ties = {{a, b}} } }, integrator = \"rk4\", dt = 0.01, duration = 10 }\n";
  const std::string pushed =
      "local w = sim.arg(\"w\", 4e-4, \"s\")\nlocal far = sim.arg(\"far\", 0.8, \"m\")\n"
      "local p = sim.particles { mass = 1 }\np:add {0, 0, 0}\np:add {3, 0, 0}\n"
      "local ball = sim.collider.sphere { radius = 0.5, center = {-1, 0, 0}, motion =\n"
      "  function(t) return {-1 + far*math.exp(-((t - 2.0013)/w)^2), 0, 0} end }\n"
      "return sim.scene { particles = p, colliders = {ball}, forces = {},\n"
      "  integrator = \"verlet\", dt = 0.01, duration = 5 }\n";
  for (const std::string& text : {led, pushed}) {
    const bool of_ball = text == pushed;
    for (const std::string method : {"verlet", "rk4", "dopri5"}) {
      INFO(method << (of_ball ? ", ball" : ", hook"));
      const sim::SceneSpec scene = sim::test::load_text(text);
      const std::int64_t steps = of_ball ? 500 : 1000;
      const Judged missed = judged(scene.systems[0], {.integrator = method}, steps);
      CHECK(missed.verdict.trust == Trust::kSuspect);
      CHECK(missed.deviation.missed_at == Approx(2.0013).margin(5e-3));
      const sim::SceneSpec slow =
          sim::test::load_text(text, {{"w", "0.3"}, {"far", of_ball ? "0.45" : "0.2"}});
      const Judged seen = judged(slow.systems[0], {.integrator = method}, steps);
      INFO(seen.verdict.reason);
      CHECK(std::isnan(seen.deviation.missed_at));
    }
  }
}

TEST_CASE("a pull that lasts for several steps is not said to be unseen") {
  struct Pull {
    double omega, speed, share;
  };
  for (const auto& [omega, speed, share] : {Pull{10, 1, 1.7}, {20, 4, 1.5}, {40, 0.5, 0.5}}) {
    sim::SystemSpec spec = make_falling(1, 0);
    spec.particles->list = {{.position = {0, 0, 0}, .mass = 1}};
    const std::string target = "max(0, min(1, " + std::to_string(speed) + "*(t - 1)))";
    spec.forces = {make_part(
        "expression", {{"fx", "-" + std::to_string(omega * omega) + "*(x - " + target + ")"}})};
    const double h = share / omega;
    const auto steps = static_cast<std::int64_t>(std::ceil(6 / h));
    const Judged found = judged(spec, {.integrator = "verlet", .dt = h}, steps);
    INFO(omega << ' ' << found.verdict.reason);
    CHECK(std::isnan(found.deviation.missed_at));
  }
}

TEST_CASE("a push that no step has felt is found") {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.forces = {
      make_part("expression", {{"fx", std::string("100*step(t - 3.1)*step(3.11 - t)")}})};
  for (const auto& [method, h] : {std::pair{"dopri5", 0.5}, {"implicit_midpoint", 0.05}}) {
    const Judged missed =
        judged(spec, {.integrator = method, .dt = h}, static_cast<std::int64_t>(std::round(6 / h)));
    INFO(method << ' ' << missed.verdict.reason);
    CHECK(missed.verdict.trust == Trust::kSuspect);
    CHECK(missed.deviation.missed_at == Approx(3.105).margin(0.006));
    CHECK(missed.verdict.reason.find("a force has a pulse near t = 3.1") != std::string::npos);
  }
  const Judged seen = judged(spec, {.integrator = "verlet", .dt = 1e-4}, 60000);
  INFO(seen.verdict.reason);
  CHECK(std::isnan(seen.deviation.missed_at));
  CHECK(seen.verdict.trust == Trust::kTrusted);
}

// The push of 1 N s moves it by 2.895 m until the end, a share of its 176 m that is not wrong yet.
// Steps of rk4 that end where the push begins and ends take 1/6 of a step too much at either.
TEST_CASE("what a push that no step has felt would have moved is in the claim") {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.forces.push_back(
      make_part("expression", {{"fx", std::string("100*step(t - 3.1)*step(3.11 - t)")}}));
  struct Felt {
    const char* method;
    double h;
  };
  for (const Felt& felt : {Felt{"verlet", 0.3}, {"dopri5", 0.01}, {"rk4", 0.01}, {"rk4", 0.001}}) {
    const Judged found = judged(spec, {.integrator = felt.method, .dt = felt.h},
                                static_cast<std::int64_t>(std::round(6 / felt.h)));
    const double error = std::abs(found.end[0] - (0.5 + 6 + 2.895));
    INFO(felt.method << ' ' << felt.h << ' ' << error << ' ' << found.verdict.reason);
    CHECK(found.deviation.error > 2.0 / 3 * error);
    CHECK(found.deviation.error < 6 * error);
    CHECK(found.verdict.trust == Trust::kTrusted);
  }
}
