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
