// Errors of sim.contact, and the behaviour of its scenes.
#include "core/geometry/triangle_mesh.h"
#include "core/particles/constraints/constraint_system.h"
#include "tests/lua/scene_text.h"
#include "tests/support/all_intersections.h"

using namespace sim;
using namespace sim::test;

namespace {

std::string sheet(const std::string& contact, const std::string& more = "") {
  return "local g = sim.grid { 4, 4, du = {0,0,0.1}, dv = {0.1,0,0}, mass = 1 }\n"
         "local skin = sim.surface { grid = g }\n"
         "return sim.scene { particles = g, forces = {}, integrator = \"verlet\", dt = 0.01,\n"
         "duration = 1, contact = " +
         contact + more + " }\n";
}

std::string error_of(const std::string& text) {
  const auto error = text_error(text);
  return error ? error->what() : "";
}

std::int64_t crossings(const Simulation& system, const SystemSpec& spec) {
  std::vector<Vec3> places;
  for (int i = 0; i < system.particles(); ++i) places.push_back(system.position(i));
  std::vector<std::array<int, 3>> triangles;
  for (const auto& surface : spec.contact->surfaces)
    triangles.insert(triangles.end(), surface->triangles().begin(), surface->triangles().end());
  return sim_test::all_crossings(places, triangles);
}

}  // namespace

TEST_CASE("what contact of surfaces refuses", "[lua]") {
  CHECK(error_of(sheet("sim.contact { surfaces = { skin }, thickness = 0.01 }")).empty());
  const std::pair<std::string, std::string> cases[] = {
      {"1", "expected a sim.contact"},
      {"sim.contact { thickness = 0.01 }", "bad surfaces of sim.contact"},
      {"sim.contact { surfaces = { g }, thickness = 0.01 }", "a sim.surface"},
      {"sim.contact { surfaces = { skin } }", "thickness"},
      {"sim.contact { surfaces = { skin }, thickness = 0 }", "it must be > 0"},
      {"sim.contact { surfaces = { skin }, thickness = 0.01, friction = -1 }", "friction"},
      {"sim.contact { surfaces = { skin }, thickness = 0.01, self = 1 }", "true or false"},
      {"sim.contact { surfaces = { skin }, thicknes = 0.01 }", "thickness"},
      {"sim.contact { surfaces = { skin }, thickness = 0.06 }", "give at most 0.05"},
  };
  for (const auto& [contact, words] : cases) {
    INFO(contact);
    CHECK(contains(error_of(sheet(contact)), words));
  }
  const std::string right = "sim.contact { surfaces = { skin }, thickness = 0.01 }";
  const auto beside_rods = [&](const std::string& more) {
    return error_of(
        sheet(right, ", constraints = { sim.constraint.distance { ties = {{0, 1}}, length = 0.1" +
                         more + " } }"));
  };
  CHECK(beside_rods("").empty());
  CHECK(contains(beside_rods(", feedback = 10"), "leave feedback out"));
  std::string adaptive = sheet(right);
  adaptive.replace(adaptive.find("verlet"), 6, "dopri5");
  CHECK(contains(error_of(adaptive), "use verlet, rk4 or another method of fixed steps"));
}

TEST_CASE("a surface that crosses or touches itself at the start is refused", "[lua]") {
  const auto two = [](const std::string& third) {
    return "local p = sim.particles { mass = 1 }\n"
           "p:add {0,0,0} p:add {1,0,0} p:add {0,0,1} p:add {0.2,-0.5,0.2} p:add {0.2,0.5,0.3}\n"
           "p:add " +
           third +
           "\n"
           "local s = sim.surface { particles = p, triangles = { {0,1,2}, {3,4,5} } }\n"
           "return sim.scene { particles = p, forces = {}, integrator = \"verlet\", dt = 0.01,\n"
           "duration = 1, contact = sim.contact { surfaces = { s }, thickness = 0.01 } }\n";
  };
  const std::string crossed = error_of(two("{0.9,0.5,0.9}"));
  CHECK(contains(crossed, "(3, 4, 5)"));
  CHECK(contains(crossed, "(0, 1, 2)"));
  CHECK(contains(crossed, "cross"));
  const std::string lying =
      "local p = sim.particles { mass = 1 }\n"
      "p:add {0,0,0} p:add {1,0,0} p:add {0,0,1} p:add {0.1,0,0.1} p:add {0.3,0.5,0.1}\n"
      "p:add {0.1,0.5,0.3}\n"
      "local s = sim.surface { particles = p, triangles = { {0,1,2}, {3,4,5} } }\n"
      "return sim.scene { particles = p, forces = {}, integrator = \"verlet\", dt = 0.01,\n"
      "duration = 1, contact = sim.contact { surfaces = { s }, thickness = 0.01 } }\n";
  CHECK(contains(error_of(lying), "touch"));
}

TEST_CASE("the scenes of contact never cross", "[lua][scenes]") {
  const std::pair<const char*, sim::test::Settings> scenes[] = {
      {"scenes/drape_self.lua", {}},
      {"scenes/fold.lua", {{"n", "12"}}},
      {"scenes/folded.lua", {{"n", "10"}}},
      {"scenes/ring.lua", {{"n", "9"}, {"speed", "1.6"}}},
      {"scenes/twist.lua", {{"n", "10"}, {"period", "0.3"}}}};
  for (const auto& [file, settings] : scenes) {
    INFO(file);
    Registry registry({SIM_PLUGIN_DIR});
    const SystemSpec spec = load(file, settings).systems[0];
    Simulation system(spec, registry);
    const std::int64_t steps = system.steps_for(system.duration());
    for (std::int64_t n = 0; n < steps; ++n) {
      REQUIRE(system.step());
      if (n % 50 == 0 || n + 1 == steps) REQUIRE(crossings(system, spec) == 0);
    }
    // Without contact it does, so that there was something to keep apart.
    SystemSpec bare = spec;
    bare.contact.reset();
    Simulation free(bare, registry);
    std::int64_t most = 0;
    for (std::int64_t n = 0; n < steps && free.step(); ++n)
      if (n % 20 == 0) most = std::max(most, crossings(free, spec));
    CHECK(most > 0);
  }
}

TEST_CASE("ends that turn by a third of a radian in a step wring a cloth that never crosses",
          "[lua]") {
  // From step 39 on zones hold particles that are led, each its own way: steps are taken in legs.
  Registry registry({SIM_PLUGIN_DIR});
  const SystemSpec spec =
      load("scenes/twist.lua", {{"n", "10"}, {"period", "0.4"}, {"stiffness", "0.5"}}).systems[0];
  Simulation system(spec, registry, {.dt = 0.02}), two(spec, registry, {.dt = 0.02, .threads = 2});
  for (int n = 0; n < 65; ++n) {
    INFO(n);
    Simulation other(spec, registry, {.dt = 0.02});  // whose lists of pairs have no past
    other.restore(system.snapshot());
    if (!system.step()) FAIL(system.divergence().why);
    REQUIRE((two.step() && other.step()));
    REQUIRE(crossings(system, spec) == 0);
    REQUIRE(two.hash() == system.hash());
    REQUIRE(other.hash() == system.hash());
  }
}

TEST_CASE("a cloth that folds goes on from any state with the bits of the whole run",
          "[lua][scenes]") {
  Registry registry({SIM_PLUGIN_DIR});
  const SystemSpec spec = load("scenes/fold.lua", {{"n", "12"}}).systems[0];
  Simulation system(spec, registry);
  const std::int64_t steps = system.steps_for(system.duration());
  for (std::int64_t n = 0; n < steps; ++n) {
    if (n % 3 != 0) {
      REQUIRE(system.step());
      continue;
    }
    Simulation other(spec, registry);  // whose list of pairs has no past
    other.restore(system.snapshot());
    REQUIRE((system.step() && other.step()));
    INFO(n);
    REQUIRE(other.hash() == system.hash());
  }
}

TEST_CASE("a box comes to rest on a cloth that lies on itself", "[lua][scenes]") {
  for (const std::string mass : {"0.2", "0.5", "5"}) {
    INFO(mass);
    Registry registry({SIM_PLUGIN_DIR});
    const SystemSpec spec = load("scenes/folded.lua", {{"n", "10"}, {"mass", mass}}).systems[0];
    Simulation system(spec, registry);
    const double layer = std::get<double>(spec.contact->given.at("thickness"));
    Vec3 before;
    while (system.t() < system.duration()) {
      REQUIRE(system.step());
      if (system.step_count() % 50 == 0) REQUIRE(crossings(system, spec) == 0);
      if (system.t() < system.duration() - 0.1) before = system.body_state(0).center;
    }
    // Two layers at least are below it, and no particle is in it.
    const RigidState box = system.body_state(0);
    CHECK(box.center.y() > 0.06 + 0.9 * layer);
    CHECK(box.center.y() < 0.15);
    // One lighter than the cloth rocks on the folds.
    if (mass != "0.2") CHECK((box.center - before).norm() < 0.005);
    double deepest = 0;
    for (int i = 0; i < 100; ++i) {
      const Vec3 at = transposed(box.axes) * (system.position(i) - box.center);
      const Vec3 depth = Vec3(0.12, 0.06, 0.1) - at.cwiseAbs();
      deepest = std::max(deepest, std::min({depth.x(), depth.y(), depth.z()}));
    }
    CHECK(deepest < 0.02 * layer);
    CHECK(system.constraint_system()->drift(system.t(), system.state().data()).position < 1e-12);
  }
}
