// sim plugin new and sim test: from nothing to a plugin that keeps its contract.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/simd/simd_targets.h"
#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

std::string fixture(const std::string& name) {
  return std::string(SIM_FIXTURE_DIR) + "/" + name + "/" + name + ".so";
}

TEST_CASE("a new plugin builds by the line it prints, passes sim test and runs") {
  for (const std::string kind :
       {"force", "field", "integrator", "constraint", "collider", "motion", "law"}) {
    INFO(kind);
    const TemporaryFolder folder;
    const ProgramOptions there{.folder = folder.path()};
    const Outcome made = run_sim({"plugin", "new", kind, "my_wind"}, there);
    INFO(made.err);
    REQUIRE(made.code == 0);
    const auto begin = made.out.find("  g++ ");
    REQUIRE(begin != std::string::npos);
    const std::string line = made.out.substr(begin, made.out.find('\n', begin) - begin);
    const std::filesystem::path inside = folder.path() / "my_wind";
    const std::string bin = std::filesystem::path(SIM_BINARY).parent_path().string();
    REQUIRE(std::system(
                ("cd '" + inside.string() + "' && PATH='" + bin + "':$PATH && " + line).c_str()) ==
            0);
    for (const auto& file : std::filesystem::directory_iterator(inside)) {
      INFO(file.path());
      if (file.path().extension() != ".so")
        CHECK(read_text(file.path()).find(SIM_SOURCE_DIR) == std::string::npos);
    }

    const Outcome test = run_sim({"test", "my_wind.so"}, {.folder = inside});
    INFO(test.out << test.err);
    CHECK(test.code == 0);
    CHECK(test.out.find("ok ") != std::string::npos);
    CHECK(test.out.find("FAILED") == std::string::npos);
    const Outcome run = run_sim({"my_wind.lua", "-n", "10"}, {.folder = inside});
    INFO(run.err);
    CHECK(run.code == 0);

    const Outcome again = run_sim({"plugin", "new", kind, "my_wind"}, there);
    CHECK(again.code == 5);
    CHECK(again.err.find("nothing is overwritten") != std::string::npos);
  }
}

TEST_CASE("sim plugin new refuses what it cannot make, and leaves nothing behind") {
  const TemporaryFolder folder;
  const ProgramOptions there{.folder = folder.path()};
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"plugin", "new", "forse", "wind"},
                                             {"plugin", "new", "force", "Wind"},
                                             {"plugin", "new", "force", "../wind"},
                                             {"plugin", "new", "force"},
                                             {"plugin", "old", "force", "wind"},
                                             {"plugin"}}) {
    INFO(words.back());
    CHECK(run_sim(words, there).code == 2);
  }
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("a plugin that crashes takes no program with it that tries it first") {
  const TemporaryFolder folder;
  write_text(folder.path() / "made.lua",
             "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 }\np:add {0, 0, 0}\n"
             "return sim.scene { particles = p, forces = { sim.force.crash_made {} },\n"
             "  integrator = 'rk4', dt = 0.1, duration = 1 }\n");
  for (const std::string name : {"crash_opened", "crash_made"}) {
    INFO(name);
    const Outcome probed = run_sim({"scenes/circle.lua", "--load", fixture(name), "--probe"});
    CHECK(probed.code == 7);
    CHECK(probed.err.find(name + ".so: it crashes: signal 11") != std::string::npos);
    const Outcome prompt = run_sim({"scenes/circle.lua", "--load", fixture(name), "--probe"},
                                   {.program = SIM_REPL_BINARY, .input = "1\n"});
    CHECK(prompt.code == 7);
    const Outcome test = run_sim({"test", fixture(name)});
    CHECK(test.code == 7);
    CHECK(test.err.find(name + ".so: it crashes: signal 11") != std::string::npos);
  }
  CHECK(run_sim({"scenes/circle.lua", "-q", "--load", fixture("attraction"), "--probe"}).code == 0);
  // Without, the signal ends the program: what was to be shown.
  CHECK(run_sim({"scenes/circle.lua", "--load", fixture("crash_opened")}).code == 128 + 11);
}

TEST_CASE("sim test finds no fault with plugins of the project, on any instruction set") {
  for (const std::string name : {"forces/drag", "integrators/midpoint", "colliders/sphere"}) {
    INFO(name);
    const Outcome outcome = run_sim({"test", SIM_PLUGIN_DIR "/" + name + ".so", "--json"});
    CHECK(outcome.code == 0);
    const Json report = read_json(outcome.out);
    CHECK(report.at("ok").flag);
    std::string bits;
    for (const Json& check : report.at("checks").list) {
      CHECK(check.at("outcome").text != "FAILED");
      if (check.at("check").text == "the same bits on every instruction set")
        bits = check.at("outcome").text;
    }
    CHECK(bits == (sim::simd_levels().size() > 1 ? "ok" : "skipped"));
  }
}

TEST_CASE("sim test tells which check failed, as text and as JSON") {
  const Outcome broken = run_sim({"test", fixture("broken_integrators")});
  CHECK(broken.code == 7);
  CHECK(broken.out.find("integrator 'wrong_order'\n  FAILED   order") != std::string::npos);
  CHECK(broken.err.find("breaks its contract") != std::string::npos);
  const Outcome json = run_sim({"test", fixture("broken_integrators"), "--json"});
  CHECK(json.code == 7);
  const Json report = read_json(json.out);
  CHECK(!report.at("ok").flag);
  bool found = false;
  for (const Json& check : report.at("checks").list)
    found = found || (check.at("check").text == "order" && check.at("outcome").text == "FAILED");
  CHECK(found);
  CHECK(run_sim({"test", "/no/such.so"}).code == 7);
  CHECK(run_sim({"test"}).code == 2);
}

}  // namespace
}  // namespace sim_test
