// sim.plugin: a scene that brings its plugin with it.
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace fs = std::filesystem;

namespace {

const std::string kParticles =
    "local particles = sim.particles {}\nparticles:add {0, 0, 0}\n"
    "local forces = { sim.force.noticed {} }\n";

void copy_library(const fs::path& file) {
  fs::create_directories(file.parent_path());
  fs::copy_file(fs::path(SIM_FIXTURE_DIR) / "noticed/noticed.so", file);
}

}  // namespace

TEST_CASE("a scene opens the plugin beside it, once", "[lua][plugin]") {
  const SceneFolder folder;
  copy_library(folder.path() / "wind.so");
  const std::string language = "local sim = require \"sim\"\n";
  const SceneSpec spec =
      load(folder.write("scene.lua", language + "sim.plugin \"wind.so\"\nsim.plugin \"wind.so\"\n" +
                                         kParticles + kEnd));
  CHECK(spec.systems[0].forces[0].plugin == "noticed");

  // Beside the file that asks, whoever requires it.
  copy_library(folder.path() / "parts/lib/other.so");
  folder.write("parts/gusts.lua", language + "sim.plugin \"lib/other.so\"\nreturn {}");
  const SceneSpec other =
      load(folder.write("other.lua", language + "require \"parts.gusts\"\n" + kParticles + kEnd));
  CHECK(other.systems[0].forces[0].plugin == "noticed");
}

TEST_CASE("a plugin that a scene cannot have is an error with its line", "[lua][plugin]") {
  const auto missing = text_error("\nsim.plugin \"wind.so\"");
  REQUIRE(missing);
  CHECK(missing->kind() == ErrorKind::kPlugin);
  CHECK(missing->text().where == "scene.lua:3");
  CHECK(contains(missing->what(), "no plugin 'wind.so'"));
  for (const char* bad : {"3", "\"/lib/wind.so\"", "\"../wind.so\"", "\"\"", "nil"}) {
    INFO(bad);
    const auto error = text_error(std::string("sim.plugin(") + bad + ")");
    REQUIRE(error);
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(error->text().where == "scene.lua:2");
    CHECK(contains(error->what(), "bad file of sim.plugin"));
  }
  const SceneFolder folder;
  folder.write("words.so", "no library");
  const auto broken = load_error(
      folder, folder.write("scene.lua", "local sim = require \"sim\"\nsim.plugin \"words.so\""));
  REQUIRE(broken);
  CHECK(broken->kind() == ErrorKind::kPlugin);
  CHECK(contains(broken->what(), "it is not a shared library"));
}

TEST_CASE("a scene takes another plugin of contact", "[lua][plugin]") {
  const SceneFolder folder;
  const fs::path library = folder.path() / "above.so";
  fs::copy_file(fs::path(SIM_FIXTURE_DIR) / "above/above.so", library);
  const auto falling = [](const std::string& contact) {
    return "local sim = require \"sim\"\nsim.plugin \"above.so\"\n"
           "local g = sim.grid { 3, 3, origin = {0,0.3,0}, du = {0,0,0.1}, dv = {0.1,0,0}, mass = "
           "1 }\n"
           "local skin = sim.surface { grid = g }\n"
           "return sim.scene { particles = g, forces = { sim.force.gravity { g = {0,-10,0} } },\n"
           "integrator = \"verlet\", dt = 0.01, duration = 1, contact = sim.contact" +
           contact + " }\n";
  };
  const SystemSpec spec =
      load(folder.write("fall.lua", falling(".above { surfaces = { skin }, level = 0.1 }")))
          .systems[0];
  CHECK(spec.contact->plugin == "above");
  Registry registry({SIM_PLUGIN_DIR}, {library});
  Simulation system(spec, registry);
  for (int n = 0; n < 100; ++n) REQUIRE(system.step());
  for (int i = 0; i < 9; ++i) CHECK(system.position(i).y() == 0.1);
  // It falls for 0.2 s, and is then stopped in each of the other 80 steps.
  CHECK(system.contact_work().lost ==
        Approx(0.5 * 9 * 100 * (0.2 * 0.2 + 80 * 0.01 * 0.01)).epsilon(0.1));

  const auto refused = [&](const std::string& contact) -> std::string {
    try {
      Simulation(load(folder.write("bad.lua", falling(contact))).systems[0], registry);
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  };
  CHECK(contains(refused(".above { surfaces = { skin } }"), "level"));
  CHECK(contains(refused(".abov { surfaces = { skin } }"), "'above'"));
  CHECK(contains(refused(".above { level = 1 }"), "bad surfaces of sim.contact"));
  CHECK(contains(refused(".bodies { surfaces = { skin } }"), "it acts on rigid bodies"));
  CHECK(contains(refused("(3)"), "expected a table of parameters"));
}
