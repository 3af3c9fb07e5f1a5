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
  CHECK(circle.growth < 1e-6);
  CHECK(spring.growth == 0);
  const sim::FastestMode grows =
      fastest(sim::test::load_text(R"(return sim.scene { state = {1, 1, 1}, dt = 1, duration = 1,
      integrator = "rk4", field = sim.field.formula { "-5*x + y", "2*y", "-3*z",
      names = {"x", "y", "z"} } })")
                  .systems[0]);
  CHECK(grows.rate == Approx(5).epsilon(1e-6));
  CHECK(grows.damping == Approx(10).epsilon(1e-6));
  CHECK(grows.growth == Approx(2).epsilon(1e-6));
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

// Contact of surfaces acts at the ends of steps.
TEST_CASE("auto keeps to steps of the given size where contact acts between them") {
  const std::string text =
      "local p = sim.particles {}\n"
      "local cloth = p:add_grid { 4, 4, origin = {-0.15, 0.2, -0.15}, du = {0, 0, 0.1},\n"
      "  dv = {0.1, 0, 0}, mass = 0.005 }\n"
      "local floor = p:add_grid { 3, 3, origin = {-0.5, 0, -0.5}, du = {0, 0, 0.5},\n"
      "  dv = {0.5, 0, 0}, mass = 0.005 }\n"
      "for i = 0, 2 do for j = 0, 2 do p:pin(floor:id(i, j)) end end\n"
      "local upper, lower = sim.surface { grid = cloth }, sim.surface { grid = floor }\n"
      "local springs = sim.force.spring { stiffness = sim.arg(\"k\", 50, \"N/m\"), grid = cloth,\n"
      "  offsets = {{0, 1}, {1, 0}} }\n"
      "local forces = { sim.force.gravity {}, springs }\n"
      "if sim.arg(\"wind\", 0, \"m/s\") > 0 then\n"
      "  forces[3] = sim.force.wind { surface = upper, velocity = {3, 0, 0} }\n"
      "end\n"
      "return sim.scene { particles = p, forces = forces, integrator = \"rk4\", dt = 0.001,\n"
      "  contact = sim.contact { surfaces = { upper, lower }, thickness = 0.01 }, duration = 1 }\n";
  sim::Registry registry({SIM_PLUGIN_DIR});
  const auto chosen = [&](const sim::test::Settings& settings, double tol) {
    const sim::SceneSpec spec = sim::test::load_text(text, settings);
    sim::Simulation simulation(spec.systems[0], registry,
                               {.integrator = {"auto", {{"tol", tol}}}, .dt = 0.001});
    CHECK_FALSE(simulation.integrator_info().adaptive);
    CHECK(simulation.step());
    return reason(simulation);
  };
  CHECK_THAT(chosen({}, 1e-9), Contains("auto: pefrl") && Contains("contact acts between steps"));
  CHECK_THAT(chosen({}, 1e-2), Contains("auto: verlet"));
  CHECK_THAT(chosen({{"k", "1e9"}}, 1e-2), Contains("auto: verlet") && Contains("stable up to"));
  CHECK_THAT(chosen({{"wind", "3"}}, 1e-5), Contains("auto: rk4"));
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
  CHECK_THAT(chosen(decays, 1, 0.9), Contains("auto: dop853"));
  CHECK_THAT(chosen(decays, 1, 1.1), Contains("auto: rodas4, steps of 1.1 s: decay up to 10 1/s"));
  CHECK_THAT(chosen(decays, 8, 1.1), Contains("auto: rodas4"));
  CHECK_THAT(chosen(decays, 9, 1.1), Contains("auto: bdf"));
  // Many numbers: only where explicit steps are shorter by far.
  CHECK_THAT(chosen(decays, 1000, 1.1), Contains("auto: bdf"));
  CHECK_THAT(chosen(decays, 1001, 1.1), Contains("auto: dopri5"));
  CHECK_THAT(chosen(decays, 1001, 19), Contains("auto: dopri5"));
  CHECK_THAT(chosen(decays, 1001, 21), Contains("auto: bdf"));
  // Formulas of high order are unstable where it oscillates.
  CHECK_THAT(chosen(turns, 1, 1.1), Contains("auto: dop853"));
  CHECK_THAT(chosen(turns, 1, 21), Contains("auto: esdirk43"));
  // Nothing is stiff while something grows nearly as fast.
  const auto starts = [&](const std::string& formulas, const std::string& words) {
    CHECK_THAT(chosen(formulas, 1, 11), Catch::StartsWith("auto: " + words));
  };
  starts("'-10*u', '3.1*v'", "dop853, steps of 11 s: growth up to 3.1 1/s");
  starts("'-10*u', '2.9*v'", "rodas4, steps of 11 s: decay up to 10 1/s");
  starts("'3*u', '-2*v'", "dop853, steps of 11 s: growth up to 3 1/s");
}

// Robertson's reactions are slow at the start and stiff 1e-3 s later: one request for a state a
// second or forty must not cost thousands of explicit steps.
TEST_CASE("auto meets stiffness within a step that was asked for") {
  sim::Registry registry = make_registry();
  const auto scene = [](double duration) {
    return sim::test::load_text(
               "return sim.scene { state = {1, 0, 0}, integrator = 'rk4', dt = 1, duration = " +
               std::to_string(duration) + R"(, field = sim.field.formula {
        '-0.04*x + 1e4*y*z', '0.04*x - 1e4*y*z - 3e7*y^2', '3e7*y^2', names = {'x', 'y', 'z'} } })")
        .systems[0];
  };
  for (const double dt : {0.4, 4.0, 40.0}) {
    CAPTURE(dt);
    const sim::MethodChoice method{"auto", {{"rtol", 1e-6}, {"atol", 1e-10}}};
    sim::Simulation simulation(scene(40), registry, {.integrator = method, .dt = dt});
    while (simulation.t() < 39.9) REQUIRE(simulation.step());
    CHECK(simulation.integrator().effort().evaluations < 2000);
    CHECK_THAT(reason(simulation), Contains("auto: rodas4"));
    // Hairer & Wanner, IV.1, and their IVP test set, to the digits given there.
    const auto x = state_of(simulation);
    CHECK(x[0] == Approx(0.7158270687).epsilon(1e-6));
    CHECK(x[1] == Approx(9.185534764e-6).epsilon(1e-5));
    CHECK(x[2] == Approx(0.2841637457).epsilon(1e-6));
  }
}

// A run that is stopped while auto looks early goes on as if nothing had happened.
TEST_CASE("auto that is stopped between its parts of a step goes on with the same bits") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec =
      sim::test::load_text(R"(return sim.scene { state = {2, 0}, integrator = 'rk4', dt = 1,
      duration = 1, field = sim.field.formula { "v", "50*(1 - x^2)*v - x", names = {"x", "v"} } })")
          .systems[0];
  const sim::RunOptions options{.integrator = {"auto", {{"tol", 1e-8}}}, .dt = 100};
  sim::Simulation whole(spec, registry, options), stopped(spec, registry, options);
  REQUIRE(whole.step());
  int asked = 0, stops = 0;
  stopped.stop_when([&] { return ++asked % 37 == 0; });
  while (!stopped.step()) REQUIRE(++stops < 10000);
  CHECK(stops > 10);
  CHECK(same_bits(state_of(whole), state_of(stopped)));
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
