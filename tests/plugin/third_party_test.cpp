// The examples of plugins/README.md: compiled, used, and printed there as they are.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/study/limits/stability.h"
#include "tests/support/scenes.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

namespace fs = std::filesystem;
using Catch::Matchers::Contains;

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  REQUIRE(in);
  return {std::istreambuf_iterator<char>(in), {}};
}

fs::path fixture(const std::string& name) {
  return fs::path(SIM_FIXTURE_DIR) / name / (name + ".so");
}

// Two particles of 2 kg, one at rest in the centre, one swinging about it.
sim::SystemSpec make_attracted() {
  sim::SystemSpec spec;
  spec.name = "attracted";
  spec.integrator = "rk4";
  spec.dt = 0.001;
  spec.particles.emplace();
  spec.particles->list = {{.position = {0, 1, 0}, .mass = 2}, {.position = {3, 1, 0}, .mass = 2}};
  spec.particles->list[1].velocity = {0, 0, 5};
  spec.forces = {make_part("attraction", {{"k", 50.0}, {"center", sim::Vec3(0, 1, 0)}})};
  return spec;
}

void check_orbit(sim::Registry& registry) {
  sim::Simulation simulation(make_attracted(), registry);
  CHECK(simulation.energy().potential == Approx(225).epsilon(1e-14));
  CHECK(simulation.energy().kinetic == Approx(25).epsilon(1e-14));
  REQUIRE(run(simulation, 1000));
  // omega = 5 rad/s: an ellipse with half axes of 3 m and 1 m.
  const sim::Vec3 exact(3 * std::cos(5.0), 1, std::sin(5.0));
  CHECK((simulation.position(1) - exact).norm() <= 1e-9);
  CHECK(simulation.position(0) == sim::Vec3(0, 1, 0));
  CHECK(simulation.energy().total() == Approx(250).epsilon(1e-9));
}

// The text between the first line that begins with `from` and the next ``` after it.
std::string block_after(const std::string& text, const std::string& from) {
  const auto begin = text.find("\n" + from);
  REQUIRE(begin != std::string::npos);
  return text.substr(begin + 1, text.find("\n```", begin) - begin);
}

}  // namespace

TEST_CASE("the README prints the example plugins as they are compiled") {
  const std::string readme = text_of(fs::path(SIM_SOURCE_DIR) / "plugins" / "README.md");
  for (const char* name : {"attraction", "decay", "ralston", "above"}) {
    const std::string source = text_of(fs::path(SIM_SOURCE_DIR) / "tests" / "plugin" / "fixtures" /
                                       (std::string(name) + ".cpp"));
    INFO(name);
    CHECK_THAT(readme, Contains("```cpp\n" + source + "```\n"));
    CHECK(std::count(source.begin(), source.end(), '\n') < 55);
  }
}

// install/outside.sh builds it with what is installed, and compares its bits with those of the
// scene.
TEST_CASE("the README of the kernel prints the program on the kernel alone as it is compiled") {
  const fs::path root = SIM_SOURCE_DIR;
  const std::string source = text_of(root / "tests" / "install" / "program" / "cloth.cpp");
  CHECK_THAT(text_of(root / "core" / "README.md"), Contains("```cpp\n" + source + "```\n"));
  CHECK(std::count(source.begin(), source.end(), '\n') < 35);
}

TEST_CASE("a third-party force works like the kernel's own") {
  sim::Registry registry = make_registry();
  registry.load(fixture("attraction"));
  check_orbit(registry);
  const sim::PluginInfo& info = registry.get<sim::Force>("attraction");
  CHECK(info.formula == "f = -k (x - center)");
  CHECK(info.params.size() == 2);

  // Its parameters are checked like all others.
  sim::SystemSpec spec = make_attracted();
  spec.forces[0].given.erase("k");
  CHECK_THROWS_WITH(sim::Simulation(spec, registry), Contains("'k' is missing"));
  spec.forces[0].given["k"] = -1.0;
  CHECK_THROWS_WITH(sim::Simulation(spec, registry), Contains("at least 0"));
}

TEST_CASE("a third-party force gives the same bits on any number of threads") {
  sim::Registry registry = make_registry();
  registry.load(fixture("attraction"));
  sim::SystemSpec spec = make_cloth(50);
  spec.forces.push_back(make_part("attraction", {{"k", 0.01}}));
  sim::Simulation one(spec, registry, {.dt = 1e-4}),
      four(spec, registry, {.dt = 1e-4, .threads = 4});
  REQUIRE(run(one, 20));
  REQUIRE(run(four, 20));
  CHECK(one.hash() == four.hash());
}

TEST_CASE("a third-party integrator and field work like the kernel's own") {
  sim::Registry registry = make_registry();
  registry.load(fixture("ralston"));
  registry.load(fixture("decay"));
  sim::SystemSpec spec;
  spec.name = "decay";
  spec.integrator = "l";
  spec.dt = 0.1;
  spec.first_order = sim::FirstOrderSpec{
      .dimension = 1, .state = {1, -7}, .field = make_part("decay", {{"rate", 2.0}})};
  sim::Simulation simulation(spec, registry);
  CHECK(simulation.method().name() == "ralston");
  REQUIRE(run(simulation, 10));
  const double factor = std::pow(1 - 0.2 + 0.02, 10);
  CHECK(simulation.flat());
  CHECK(simulation.component(0) == Approx(factor).epsilon(1e-14));
  CHECK(simulation.component(1) == Approx(-7 * factor).epsilon(1e-14));
}

// On q'' = -omega^2 q - gamma q' its roots are on the circle at h omega = (4 gamma / omega)^(1/3).
TEST_CASE("the largest stable step of a multistep method is measured") {
  sim::Registry registry = make_registry();
  registry.load(fixture("adams_bashforth"));
  const sim::SystemSpec cloth = make_cloth(8);
  const auto study =
      sim::study::stability({&cloth, &registry}, {.integrators = {{"adams_bashforth"}, {"rk4"}}},
                            [](std::string_view, double) { return true; });
  CHECK_FALSE(study.methods[0].predicted.has_value());
  CHECK(study.methods[0].measured.value() == Approx(0.0014).epsilon(0.03));
  CHECK(study.methods[1].measured.value() == Approx(0.01474).epsilon(1e-3));
}

TEST_CASE("the command of the README builds a plugin outside the tree") {
  const TemporaryFolder folder;
  const fs::path source = fs::path(SIM_SOURCE_DIR) / "tests" / "plugin" / "fixtures";
  fs::copy_file(source / "attraction.cpp", folder.path() / "attraction.cpp");
  std::string command =
      block_after(text_of(fs::path(SIM_SOURCE_DIR) / "plugins" / "README.md"), "g++ -std=c++20");
  REQUIRE_THAT(command, Contains(" -shared -fPIC ") && Contains(" -lsimkernel"));
  // The compiler and the folder of this build in place of the usual ones.
  const auto replace = [&command](const std::string& what, const std::string& with) {
    const auto place = command.find(what);
    REQUIRE(place != std::string::npos);
    command.replace(place, what.size(), with);
  };
  replace("g++", "\"$SIM_CXX\"");
  replace("$SIM/build/lib/sim", "$SIM_LIB");
  setenv("SIM", SIM_SOURCE_DIR, 1);
  setenv("SIM_CXX", SIM_CXX, 1);
  setenv("SIM_LIB", SIM_LIB_DIR "/sim", 1);
  setenv("SIM_PLACE", folder.path().c_str(), 1);
  REQUIRE(std::system(("cd \"$SIM_PLACE\" && " + command).c_str()) == 0);

  sim::Registry registry({SIM_PLUGIN_DIR, folder.path()});
  CHECK(registry.rejected().empty());
  check_orbit(registry);
  CHECK(registry.get<sim::Force>("attraction").file == (folder.path() / "attraction.so").string());
}
