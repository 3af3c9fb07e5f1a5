// The budget of Lua, as the command line, the environment and the prompt have it.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string scene_of(const TemporaryFolder& folder, const std::string& text) {
  const std::string file = (folder.path() / "hostile.lua").string();
  write_text(file, text);
  return file;
}

}  // namespace

TEST_CASE("a scene that does not end is ended, and the line named", "[cli][budget]") {
  const TemporaryFolder folder;
  const std::string loop = scene_of(folder, "local x\nwhile true do end\n");
  for (const char* limit : {"time=0.2", "steps=1e6"}) {
    INFO(limit);
    const Outcome outcome = run_sim({loop, "--lua-budget", limit});
    CHECK(outcome.code == 3);
    CHECK(has(outcome.err, "sim: error: Lua takes too long: " + loop + ":2: "));
    CHECK(has(outcome.err, "or allow more: --lua-budget "));
  }
  ProgramOptions environment;
  environment.environment = {{"SIM_LUA_BUDGET", "steps=1e6"}};
  CHECK(run_sim({loop}, environment).code == 3);

  const std::string large = scene_of(folder, "local s = ('x'):rep(3e7)\nreturn s\n");
  const Outcome outcome = run_sim({large, "--lua-budget", "memory=20"});
  CHECK(outcome.code == 3);
  CHECK(has(outcome.err, "hostile.lua:1: the scene needs more than 20 MB in Lua"));
}

TEST_CASE("a budget is that of the run, not of each call", "[cli][budget]") {
  const TemporaryFolder folder;
  const auto scene = [&](const std::string& work) {
    return scene_of(folder,
                    "local sim = require 'sim'\nreturn sim.scene { state = {1}, field = "
                    "sim.field.lua { function(t, x) " +
                        work +
                        " return { -x[1] } end }, integrator = 'rk4', dt = 1e-4, duration "
                        "= 100 }\n");
  };
  for (const std::string work : {"", "for i = 1, 2e4 do end"})
    for (const std::string limit : {"time=0.2", "steps=1e6"}) {
      INFO(work << limit);
      const Outcome outcome = run_sim({scene(work), "--lua-budget", limit});
      CHECK(outcome.code == 3);
      CHECK(has(outcome.err, "Lua takes too long: "));
      CHECK(has(outcome.err, " in all (in step "));
    }
  // Without one each call has its own.
  CHECK(run_sim({scene(""), "-n", "20000"}).code == 0);
}

// No instruction ends, and none of the library's functions runs: only the watchdog sees it.
TEST_CASE("one instruction that does not end is ended", "[cli][budget]") {
  const TemporaryFolder folder;
  const std::string chain = scene_of(folder,
                                     "local t = print\n"
                                     "for i = 1, 9e5 do t = setmetatable({}, {__call = t}) end\n"
                                     "t()\n");
  const Outcome outcome = run_sim({chain, "--lua-budget", "time=1"});
  CHECK(outcome.code == 3);
  CHECK(has(outcome.err, "sim: error: Lua takes too long: " + chain + ":"));
}

TEST_CASE("a budget that makes no sense is a usage error", "[cli][budget]") {
  for (const char* wrong : {"time", "time=", "time=0", "time=nan", "memory=-1", "speed=3",
                            "time=1;", "steps=1e99", "time=1,,steps=2"}) {
    INFO(wrong);
    CHECK(run_sim({"--lua-budget", wrong}).code == 2);
    ProgramOptions environment;
    environment.environment = {{"SIM_LUA_BUDGET", wrong}};
    CHECK(run_sim({"-n", "0"}, environment).code == 2);
  }
}

TEST_CASE("--safe bounds what a scene builds in the kernel", "[cli][budget]") {
  const TemporaryFolder folder;
  const ProgramOptions options{.folder = folder.path()};
  const std::string head = "local sim = require 'sim'\nlocal v = {{0,1},{1,0},{1,1},{1,-1}}\n",
                    tail = ", integrator = 'verlet', dt = 0.001, duration = 0.001 }\n";
  const auto says = [&](const std::string& body, const std::vector<std::string>& words) {
    write_text(folder.path() / "big.lua", head + body + tail);
    std::vector<std::string> all{"big.lua", "-n", "0", "--no-verify"};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome outcome = run_sim(all, options);
    return outcome.code == 0 ? std::string("runs") : outcome.err;
  };
  const std::string grid =
                        "local g = sim.grid { 1001, 1000, du = {1,0,0}, dv = {0,1,0}, mass = 1 }\n",
                    scene = "return sim.scene { particles = g, forces = {}";
  CHECK(has(says(grid + scene, {"--safe"}), "too many particles: big.lua:3: 1001000, and --safe"));
  CHECK(says(grid + scene, {}) == "runs");
  // Ties of several forces count together, before anything is made of them.
  const std::string half =
      "local g = sim.grid { 900, 900, du = {1,0,0}, dv = {0,1,0}, mass = 1 }\nlocal f = {}\n"
      "for i = 1, N do f[i] = sim.force.spring { family = 'f' .. i, stiffness = 1, grid = g,\n"
      "  offsets = v } end\n";
  const std::string made = "return sim.scene { particles = g, forces = f";
  const auto families = [&](const std::string& n) { return "local N = " + n + "\n" + half + made; };
  CHECK(says(families("2"), {"--safe"}) == "runs");
  CHECK(has(says(families("4"), {"--safe"}), "too many ties, triangles and cells: big.lua:"));
}

TEST_CASE("--safe keeps a scene to its folder and from plugins", "[cli][budget]") {
  const TemporaryFolder folder;
  namespace fs = std::filesystem;
  fs::create_directory(folder.path() / "scene");
  write_text(folder.path() / "secret.lua", "return { secret = 1 }\n");
  write_text(folder.path() / "scene/part.lua", "return { k = 2 }\n");
  fs::create_symlink(folder.path() / "secret.lua", folder.path() / "scene/link.lua");
  const std::string good =
      "local sim = require 'sim' assert(require('part').k == 2)\n"
      "return sim.scene { state = {1}, field = sim.field.lua { function(t, x) return {-x[1]} end "
      "}, "
      "integrator = 'rk4', dt = 0.1, duration = 1 }\n";
  ProgramOptions options;
  options.folder = folder.path() / "scene";
  write_text(options.folder / "s.lua", good);
  CHECK(run_sim({"s.lua", "--safe"}, options).code == 0);
  write_text(options.folder / "s.lua", "require 'link'\n" + good);
  CHECK(run_sim({"s.lua"}, options).code == 0);
  const Outcome outside = run_sim({"s.lua", "--safe"}, options);
  CHECK(outside.code == 3);
  CHECK(has(outside.err, "s.lua:1: it lies outside the scene's folder"));
  write_text(options.folder / "s.lua", "require('sim').plugin 'own.so'\n" + good);
  const Outcome plugin = run_sim({"s.lua", "--safe"}, options);
  CHECK(plugin.code == 3);
  CHECK(has(plugin.err, "s.lua:1: --safe opens none that a scene brings"));
  write_text(options.folder / "s.lua", "local s = ('x'):rep(3e8)\n" + good);
  CHECK(has(run_sim({"s.lua", "--safe"}, options).err, "more than 256 MB"));
}

TEST_CASE("the prompt has a budget for each line", "[cli][budget]") {
  ProgramOptions repl;
  repl.program = SIM_REPL_BINARY;
  const Outcome outcome =
      run_sim({"--lua-budget", "steps=1e6", "-e", "x = 5", "-e", "while true do end"}, repl);
  CHECK(outcome.code == 3);
  CHECK(has(outcome.err, "Lua takes too long"));
  // The kernel's time between calls does not count as Lua's.
  const Outcome run = run_sim(
      {"--lua-budget", "time=0.05", "-e", "for i = 1, 20 do step(1000) end", "-e", "t()"}, repl);
  CHECK(run.code == 0);
  CHECK(has(run.out, "100"));
}

TEST_CASE("who refused memory is said", "[cli][budget]") {
  const TemporaryFolder folder;
  // One string of 1 GB, which takes as much again while it is made.
  const Outcome limit = run_sim({scene_of(folder, "local x\nlocal s = ('x'):rep(2^30)\n")});
  CHECK(limit.code == 3);
  CHECK(has(limit.err, "hostile.lua:2: the scene needs more than 1024 MB in Lua"));
  CHECK(has(limit.err, "--lua-budget memory=4096"));
}
