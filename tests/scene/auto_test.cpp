// The choice of `auto`, its reason, and its consistency with what it does.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/array.h"
#include "core/ode/fastest_mode.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;
using Catch::Contains;

namespace {

std::string reason(const sim::Simulation& simulation) {
  const std::vector<std::string> notes = simulation.integrator().notes();
  return notes.empty() ? "" : notes.front();
}

// The reason that `auto` gives for a scene.
std::string choice(const sim::SystemSpec& spec, sim::Registry& registry, double dt,
                   std::map<std::string, sim::Value> given = {}) {
  return reason(sim::Simulation(spec, registry, {.integrator = {"auto", given}, .dt = dt}));
}

sim::SystemSpec make_stiff_cloth(double stiffness) {
  sim::SystemSpec spec = make_cloth(8);
  for (sim::PartSpec& force : spec.forces)
    if (force.plugin == "spring") force.given["stiffness"] = stiffness;
  return spec;
}

}  // namespace

TEST_CASE("the fastest mode of known systems") {
  sim::Registry registry = make_registry();
  const auto fastest = [&](const sim::SystemSpec& spec) {
    sim::Simulation simulation(spec, registry);
    return sim::fastest_mode(simulation.ode(), 0, simulation.state().data());
  };
  const sim::FastestMode cloth = fastest(make_cloth(8));
  CHECK(cloth.rate == Approx(192.678).epsilon(1e-3));
  CHECK(cloth.damping == Approx(2).epsilon(0.05));
  const sim::FastestMode spring = fastest(make_vertical_spring(1.5));
  CHECK(spring.rate == Approx(7).epsilon(1e-6));
  CHECK(spring.damping == Approx(1.5).epsilon(1e-6));
  const sim::FastestMode circle = fastest(make_circle());
  CHECK(circle.rate == Approx(1).epsilon(1e-6));
  CHECK(std::fabs(circle.damping) < 1e-6);
  CHECK(fastest(make_falling(1, 0)).rate == 0);
  CHECK(fastest(make_falling(1, 3)).rate == Approx(3).epsilon(1e-6));
}

TEST_CASE("auto chooses by stiffness, damping, accuracy and order") {
  sim::Registry registry = make_registry();
  CHECK_THAT(choice(make_cloth(8), registry, 0.005), Contains("auto: pefrl, steps of 0.005 s") &&
                                                         Contains("omega up to 193 rad/s") &&
                                                         Contains("damping 2"));
  CHECK_THAT(choice(make_cloth(8), registry, 0.05), Contains("pefrl, 7 steps to each of 0.05 s"));
  CHECK_THAT(choice(make_cloth(8), registry, 0.005, {{"tol", 1e-2}}), Contains("verlet"));
  CHECK_THAT(choice(make_cloth(8), registry, 0.005, {{"tol", 1e-9}}), Contains("dop853"));
  CHECK_THAT(choice(make_stiff_cloth(1e10), registry, 0.005), Contains("esdirk43"));
  CHECK_THAT(choice(make_vertical_spring(30), registry, 0.1), Contains("verlet"));
  CHECK_THAT(choice(make_circle(), registry, 0.01), Contains("dopri5") && Contains("first order"));
  CHECK_THAT(choice(make_falling(1, 0), registry, 0.1), Contains("nothing vibrates"));
}

TEST_CASE("auto takes bdf or rodas4 for fields that decay, as soon as it pays") {
  sim::Registry registry = make_registry();
  // x' = -rate x in each of n numbers, or a rotation with that rate.
  const auto chosen = [&](const std::string& formulas, int cells, double h) {
    const sim::SceneSpec scene = sim::test::load_text(
        "local n, state = " + std::to_string(cells) +
        ", {}\n"
        "for i = 1, 2 * n do state[i] = 1 end\n"
        "return sim.scene { state = state, integrator = 'rk4', dt = 1, duration = 1,\n"
        "  field = sim.field.formula { " +
        formulas + ", names = {'u', 'v'}, cells = n } }\n");
    return choice(scene.systems[0], registry, h);
  };
  const std::string decays = "'-10*u', '-v'", turns = "'-10*v', '10*u'";
  CHECK_THAT(chosen(decays, 1, 0.9), Contains("auto: dopri5"));
  CHECK_THAT(chosen(decays, 1, 1.1), Contains("auto: rodas4, steps of 1.1 s: decay up to 10 1/s"));
  CHECK_THAT(chosen(decays, 8, 1.1), Contains("auto: rodas4"));
  CHECK_THAT(chosen(decays, 9, 1.1), Contains("auto: bdf"));
  // Many numbers: only where explicit steps are shorter by far.
  CHECK_THAT(chosen(decays, 1000, 1.1), Contains("auto: bdf"));
  CHECK_THAT(chosen(decays, 1001, 1.1), Contains("auto: dopri5"));
  CHECK_THAT(chosen(decays, 1001, 19), Contains("auto: dopri5"));
  CHECK_THAT(chosen(decays, 1001, 21), Contains("auto: bdf"));
  // Formulas of high order are unstable where it oscillates.
  CHECK_THAT(chosen(turns, 1, 1.1), Contains("auto: dopri5"));
  CHECK_THAT(chosen(turns, 1, 21), Contains("auto: esdirk43"));
}

TEST_CASE("auto runs the method that it names") {
  sim::Registry registry = make_registry();
  sim::Simulation chosen(make_cloth(8), registry, {.integrator = "auto", .dt = 0.05});
  sim::Simulation named(make_cloth(8), registry, {.integrator = "pefrl", .dt = 0.05 / 7});
  REQUIRE(run(chosen, 20));
  REQUIRE(run(named, 140));
  CHECK(same_bits(state_of(chosen), state_of(named)));
  CHECK(chosen.t() == 1);

  const Table table("cloth8.csv");
  double worst = 0;
  for (const Row& row : table.rows_where("t", 1.0)) {
    const sim::Vec3 exact(row.number("x"), row.number("y"), row.number("z"));
    worst =
        std::max(worst, (chosen.position(static_cast<int>(row.number("particle"))) - exact).norm());
  }
  CHECK(worst < 1e-5);
}

TEST_CASE("a choice is remembered with the state") {
  sim::Registry registry = make_registry();
  const sim::Method method(registry, "auto");
  sim::Simulation scene(make_cloth(6), registry);
  sim::OdeSystem& system = scene.ode();
  const auto first = method.make(), second = method.make();
  sim::Array x(system.size()), next(system.size()), again(system.size());
  std::ranges::copy(scene.state(), x.data());

  // Both start from different states; one takes over the memory of the other.
  first->prepare(system);
  first->restart(0, 0.05, x.data());
  REQUIRE(first->step(system, 0, 0.05, x.data(), next.data()) == sim::StepStatus::kDone);
  second->prepare(system);
  second->restart(0.05, 1e-4, next.data());
  second->recall(first->memory());
  REQUIRE(first->step(system, 0.05, 0.05, next.data(), x.data()) == sim::StepStatus::kDone);
  REQUIRE(second->step(system, 0.05, 0.05, next.data(), again.data()) == sim::StepStatus::kDone);
  CHECK(std::ranges::equal(x.span(), again.span()));
}
