// Functions of a scene that are called after it was loaded.
#include "tests/lua/scene_text.h"

#include <cmath>

#include "core/scene/simulation.h"

using namespace sim;
using namespace sim::test;

namespace {

std::string ode(const std::string& state, const std::string& function,
                const std::string& more = "") {
  return "return sim.scene { state = " + state + ", field = sim.field.lua { " + function +
         " }, integrator = 'rk4', dt = 0.01, duration = 1" + more + " }\n";
}

// The error of the first step of a scene.
std::optional<Error> step_error(const std::string& text) {
  const SceneSpec spec = load_text(text);
  Registry registry({SIM_PLUGIN_DIR});
  Simulation simulation(spec.systems[0], registry);
  try {
    simulation.step();
  } catch (const Error& error) {
    return error;
  }
  return {};
}

}  // namespace

TEST_CASE("an ODE written in Lua outlives its loading", "[lua][functions]") {
  const SceneSpec spec =
      load_text("local w = 2\n" +
                ode("{1, 0}", "function(t, x) return { x[2], -w * w * x[1] } end",
                    ", exact = function(t) return { math.cos(2 * t), -2 * math.sin(2 * t) } end"));
  const SystemSpec& system = spec.systems[0];
  CHECK(system.first_order->dimension == 1);
  Registry registry({SIM_PLUGIN_DIR});
  Simulation simulation(system, registry);
  for (int i = 0; i < 100; ++i) REQUIRE(simulation.step());
  CHECK(simulation.component(0) == Approx(std::cos(2.0)).epsilon(1e-7));
  CHECK(system.exact(1)[1] == -2 * std::sin(2.0));
}

TEST_CASE("a scene whose steps call Lua says that it knows no threads", "[lua][functions]") {
  CHECK(load_text(ode("{1}", "function(t, x) return x end")).systems[0].one_thread);
  const auto with = [](const std::string& more) {
    return load_text(
               "local p = sim.particles {}\np:add {0, 0, 0}\nreturn sim.scene { particles = "
               "p, integrator = 'rk4', dt = 0.01, duration = 1, " +
               more + " }\n")
        .systems[0]
        .one_thread;
  };
  CHECK(with("forces = { sim.force.lua { function(t, i, x, v) return 0, 0, 0 end } }"));
  CHECK(
      with("forces = {}, constraints = { sim.constraint.on_curve { particles = {0}, curve = "
           "function(s) return {s, 0, 0} end } }"));
  // Observers and an exact solution are evaluated between steps.
  CHECK(
      !with("forces = { sim.force.gravity {} }, observe = { x = function(s) return "
            "s:position(0)[1] end }, exact = function(t) return {0, 0, 0} end"));
}

TEST_CASE("the right-hand side sees the time", "[lua][functions]") {
  const SceneSpec spec = load_text(ode("{0}", "f = function(t, x) return { 2 * t } end"));
  Registry registry({SIM_PLUGIN_DIR});
  Simulation simulation(spec.systems[0], registry);
  for (int i = 0; i < 100; ++i) REQUIRE(simulation.step());
  CHECK(simulation.component(0) == Approx(1).epsilon(1e-13));
}

TEST_CASE("points reach Lua as vectors and come back as vectors or flat", "[lua][functions]") {
  const std::string state = "{ x = { {1, 0, 0}, {0, 2, 0} } }";
  const std::string check = "function(t, x) assert(#x == 2 and #x[1] == 3) return ";
  const std::string results[] = {
      "{ { -x[1][2], x[1][1], 0 }, { -x[2][2], x[2][1], 0 } } end",
      "{ -x[1][2], x[1][1], 0, -x[2][2], x[2][1], 0 } end",
  };
  Registry registry({SIM_PLUGIN_DIR});
  const SceneSpec built_in = load_text("return sim.scene { state = " + state +
                                       ", field = sim.field.rotation { omega = 1 }, integrator = "
                                       "'rk4', dt = 0.01, duration = 1 }");
  for (const std::string& result : results) {
    const SceneSpec spec = load_text(ode(state, check + result));
    Simulation a(spec.systems[0], registry), b(built_in.systems[0], registry);
    for (int i = 0; i < 10; ++i) REQUIRE((a.step() && b.step()));
    for (int i = 0; i < 2; ++i) CHECK((a.position(i) - b.position(i)).norm() < 1e-15);
  }
}

TEST_CASE("bad results of a function name its line", "[lua][functions]") {
  const struct {
    const char *state, *function, *says;
  } cases[] = {
      {"{1, 2}", "function(t, x) return { 1 } end", "got a list of 1 values"},
      {"{1, 2}", "function(t, x) return { 1, 2, 3 } end", "got a list of 3 values"},
      {"{1, 2}", "function(t, x) return 5 end", "got 5"},
      {"{1, 2}", "function(t, x) end", "got nothing"},
      {"{1, 2}", "function(t, x) return { 1, '2' } end", "got '2'"},
      {"{1, 2}", "function(t, x) return { 1, {} } end", "got a table"},
      {"{1, 2, 3}", "function(t, x) return { {1, 2, 3} } end", "list of 1 tables"},
      {"{ x = {{1, 2, 3}} }", "function(t, x) return { {1, 2} } end", "not a vector"},
      {"{ x = {{1, 2, 3}} }", "function(t, x) return { {1, 2, x} } end", "got a table"},
      {"{ x = {{1, 2, 3}} }", "function(t, x) return { 1, 2 } end", "1 vectors"},
      {"{1, 2}", "function(t, x) return { x.y.z, 1 } end", "field 'y'"},
      {"{1, 2}", "function(t, x) return error('stop') end", "stop"},
      {"{1, 2}", "function(t, x) return error({}) end", "error object"},
      {"{1, 2}", "function(t, x) local function f() return 1 + f() end return f() end",
       "stack overflow"},
  };
  int wrong = 0;
  for (const auto& [state, function, says] : cases) {
    INFO(function);
    const auto error = step_error("\n\n" + ode(state, function));
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(error->text().where.ends_with("scene.lua:4"));
    CHECK(contains(error->what(), says));
    if (error->text().what != "bad result of a function" ||
        error->text().why.starts_with("expected numbers, got "))
      continue;
    ++wrong;
    CHECK(error->text().why.starts_with("expected a list of "));
    CHECK(contains(error->text().why, ", got "));
    CHECK(error->text().remedy == "return it in the form of the state");
  }
  CHECK(wrong == 7);
}

TEST_CASE("a solution that blows up diverges instead of failing", "[lua][functions]") {
  const SceneSpec spec = load_text(ode("{1}", "function(t, x) return { x[1]^2 * 1e3 } end"));
  Registry registry({SIM_PLUGIN_DIR});
  Simulation simulation(spec.systems[0], registry);
  bool finite = true;
  for (int i = 0; i < 100 && finite; ++i) finite = simulation.step();
  CHECK_FALSE(finite);
  CHECK(std::isfinite(simulation.component(0)));
}

TEST_CASE("a failed call leaves the state usable", "[lua][functions]") {
  const SceneSpec spec =
      load_text(ode("{1}", "function(t, x) if t == 0 then error('first') end return { 1 } end",
                    ", exact = function(t) return { t } end"));
  Registry registry({SIM_PLUGIN_DIR});
  Simulation simulation(spec.systems[0], registry);
  for (int i = 0; i < 300; ++i) CHECK_THROWS_AS(simulation.step(), Error);
  CHECK(spec.systems[0].exact(3) == std::vector<double>{3});
}

TEST_CASE("exact solutions are checked", "[lua][functions]") {
  const auto exact = [](const std::string& body) {
    return load_text(ode("{1, 2}", "function(t, x) return x end",
                         ", exact = function(t) return " + body + " end"))
        .systems[0]
        .exact;
  };
  CHECK(exact("{ t, 2 * t }")(1.5) == std::vector<double>{1.5, 3});
  CHECK_THROWS_AS(exact("{ t }")(1), Error);
  CHECK_THROWS_AS(exact("t")(1), Error);
  CHECK_THROWS_AS(exact("{ t, 0/0 }")(1), Error);

  const SystemSpec particles = load_text(
                                   "local p = sim.particles {}\np:add {0, 1, 2}\n"
                                   "return sim.scene { particles = p, forces = {}, integrator = "
                                   "'rk4', dt = 1, duration = 1, "
                                   "exact = function(t) return { {0, 1, 2 + t} } end }")
                                   .systems[0];
  CHECK(particles.exact(1) == std::vector<double>{0, 1, 3});
}
