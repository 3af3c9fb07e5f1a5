// The diagnosis of a diverged run, and recommended steps that work.
#include "core/study/verdict/postmortem.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::PostMortem;
using sim::study::Trust;

namespace {

sim::study::Watch no_watch() {
  return [](std::string_view, double) { return true; };
}

PostMortem examine(const sim::SystemSpec& spec, const std::string& integrator, double dt,
                   double time, std::map<std::string, sim::Value> given = {},
                   double seconds = 1e9) {
  sim::Registry registry = make_registry();
  const sim::study::Problem problem{
      &spec, &registry, {.integrator = {integrator, std::move(given)}, .dt = dt}};
  return sim::study::post_mortem(problem, std::lround(time / dt), time, seconds, no_watch());
}

// Runs the scene as a user would.
bool runs(const sim::SystemSpec& spec, const std::string& integrator, double dt, double time) {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(spec, registry, {.integrator = integrator, .dt = dt});
  const double start = simulation.energy().total();
  if (!run(simulation, simulation.steps_for(time))) return false;
  return simulation.energy().total() <= start + 0.1;
}

}  // namespace

TEST_CASE("euler on the cloth: the first spring, and a step and a method that really work") {
  const sim::SystemSpec cloth = make_cloth(8);
  const PostMortem found = examine(cloth, "euler", 0.005, 1);
  CHECK(found.limit_share == Approx(0.005 / 5.387e-5).epsilon(0.01));
  REQUIRE(found.spring.has_value());
  CHECK(std::abs(found.spring->strain) > 1);
  CHECK_FALSE(found.family.empty());
  CHECK(found.since > 5);
  CHECK(found.t == Approx(0.005 * static_cast<double>(found.since)));
  CHECK(found.growth > 1.2);
  CHECK(found.growth < 4);
  // Structural, shear, flex, gravity and drag, by size.
  REQUIRE(found.forces.size() == 5);
  for (std::size_t i = 1; i < 5; ++i) CHECK(found.forces[i].second <= found.forces[i - 1].second);

  REQUIRE(found.smaller.has_value());
  CHECK(found.smaller->verdict.trust == Trust::kTrusted);
  CHECK(runs(cloth, "euler", found.smaller->dt, 1));
  REQUIRE(found.other.has_value());
  CHECK(found.other->integrator != "euler");
  CHECK(runs(cloth, found.other->integrator, 0.005, 1));
  // One step further the same spring was still in its range.
  sim::Registry registry = make_registry();
  sim::Simulation before(cloth, registry, {.integrator = "euler", .dt = 0.005});
  REQUIRE(run(before, found.since - 1));
  CHECK(std::abs(sim::study::worst_spring(before).strain) < 1);
}

TEST_CASE("what a post-mortem tells to run is the method as it was chosen") {
  CHECK(examine(make_cloth(4), "euler", 0.05, 1).choice == "euler");
  const PostMortem found =
      examine(make_cloth(4), "euler", 0.05, 1, {{"precision", std::string("single")}});
  CHECK(found.integrator == "euler");
  CHECK(found.choice == "euler:precision=single");
}

TEST_CASE("a method without a stable step on a pendulum is replaced") {
  const PostMortem found = examine(make_elastic_pendulum(), "euler", 0.1, 20);
  CHECK(std::isinf(found.limit_share));
  REQUIRE(found.other.has_value());
  CHECK(runs(make_elastic_pendulum(), found.other->integrator, found.other->dt, 20));
}

TEST_CASE("forces on a particle are those of its springs, its weight and its drag") {
  sim::SystemSpec spec = make_row();
  spec.particles->list[5].position.x() = 5.2;
  spec.particles->list[5].velocity = {0, 3, 0};
  spec.forces.push_back(make_gravity());
  spec.forces.push_back(make_drag(0.5));
  spec.integrator = "euler";
  // A step so large that the springs fail in the first one.
  const PostMortem found = examine(spec, "euler", 10, 20);
  REQUIRE(found.spring.has_value());
  CHECK(found.since == 1);
  REQUIRE(found.forces.size() == 3);
  for (const auto& [name, force] : found.forces)
    if (name == "gravity") CHECK(force == Approx(0.1 * kGravity));
}

TEST_CASE("a post-mortem of what cannot be tried in time says so, and is quick") {
  const PostMortem found = examine(make_cloth(8), "rk4", 1000, 1e6);
  CHECK_FALSE(found.complete);
  CHECK_FALSE(found.smaller.has_value());
}

TEST_CASE("a first-order system has no springs, but a remedy") {
  sim::SystemSpec spec = make_circle();
  spec.exact = [](double t) { return std::vector<double>{std::cos(t), std::sin(t), 0}; };
  const PostMortem found = examine(spec, "euler", 100, 3e4);
  CHECK_FALSE(found.spring.has_value());
  // A method that misses the exact solution is no remedy.
  if (found.other) CHECK(found.other->verdict.trust == Trust::kTrusted);
}

// y' = y^2 from 1 has no end beyond t = 1, whatever the step: eight are tried, from half of it.
TEST_CASE("a post-mortem tries eight steps by halves where none works") {
  std::vector<double> steps;  // s, from each start at t = 0
  double before = 0;
  sim::SystemSpec spec = make_circle();
  spec.exact = {};
  spec.first_order->dimension = 1;
  spec.first_order->state = {1};
  spec.first_order->field = make_part(
      "lua", {{"f", sim::OdeFunction([&](double t, std::span<const double> x, std::span<double> d) {
                 if (before == 0 && t > 0) steps.push_back(t);
                 before = t;
                 d[0] = x[0] * x[0];
               })}});
  const PostMortem found = examine(spec, "euler", 0.1, 4);
  CHECK(found.complete);
  CHECK_FALSE(found.smaller.has_value());
  for (int k = 0; k < 10; ++k) {
    INFO(k);
    const double step = 0.05 / std::pow(2, k);
    const auto tried = std::count_if(
        steps.begin(), steps.end(), [step](double each) { return std::fabs(each - step) < 1e-12; });
    CHECK((k < 8 ? tried > 0 : tried == 0));
  }
}

TEST_CASE("a post-mortem ends when its seconds are over, also inside a step") {
  const PostMortem none = examine(make_cloth(8), "euler", 0.005, 1, {}, 0);
  CHECK_FALSE(none.complete);
  CHECK_FALSE((none.spring || none.smaller || none.other));
  // No residual is as small as that: a step takes seconds at least.
  const PostMortem hanging =
      examine(make_cloth(96), "implicit_midpoint", 0.5, 20,
              {{"tol", 1e-300}, {"newton_steps", std::int64_t{10'000}}}, 0.1);
  CHECK_FALSE(hanging.complete);
  CHECK(hanging.step == 0);
}

TEST_CASE("what a post-mortem says works was held to its shadow") {
  sim::Registry registry = make_registry();
  // An oscillator of omega = 100 rad/s: at 5 % of the limit verlet keeps its energy and not its
  // phase, cos(7000 rad).
  sim::SystemSpec spec = make_elastic_pendulum();
  spec.forces.clear();
  sim::PartSpec springs = make_springs("spring", 10000);
  springs.elements.ids = {0, 1};
  springs.elements.values["rest"] = {0};
  spec.forces.push_back(springs);
  const sim::study::Problem problem{&spec, &registry, {.integrator = {"verlet", {}}, .dt = 0.001}};
  const auto run = sim::study::try_run(problem, 0.001, 200, no_watch());
  REQUIRE(run);
  INFO(run->verdict.reason);
  CHECK(run->verdict.trust == Trust::kSuspect);
  CHECK_FALSE(PostMortem::works(run->verdict));
}

TEST_CASE("remedies are tried in a scene that observes, too") {
  sim::SystemSpec cloth = make_cloth(4);
  cloth.observers.push_back(
      {"sag", [](const sim::Simulation& system) { return system.position(5).y(); }});
  const PostMortem found = examine(cloth, "euler", 0.05, 0.2);
  REQUIRE(found.smaller.has_value());
  CHECK(found.smaller->verdict.trust == Trust::kTrusted);
}
