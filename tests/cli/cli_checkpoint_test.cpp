// sim --snap and --resume: one run in two parts is the run in one part.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

std::vector<std::string> joined(std::vector<std::string> list, std::vector<std::string> more) {
  list.insert(list.end(), more.begin(), more.end());
  return list;
}

}  // namespace

TEST_CASE("a run in two parts has the rows of the run in one") {
  TemporaryFolder folder;
  const std::string snap = (folder.path() / "a.snap").string();
  for (const std::vector<std::string>& run :
       std::vector<std::vector<std::string>>{{"scenes/cloth.lua", "verlet", "0.002", "-s", "n=5"},
                                             {"scenes/pendulum.lua"},
                                             {"scenes/circle.lua"},
                                             {"scenes/cloth.lua", "-i", "dopri5", "--tol", "1e-7"},
                                             {"scenes/cloth.lua", "-i", "rk4:precision=single"},
                                             {"scenes/sample.lua"}}) {
    const std::string scene = run.front();
    INFO(scene);
    REQUIRE(run_sim(joined(run, {"-n", "60", "-q", "--snap", snap})).code == 0);
    const auto rest = [&](const std::string& table) {
      return lines_of(run_sim({scene, "--resume", snap, "-n", "100", "-q", table}).out);
    };
    const auto whole = [&](const std::string& table) {
      return lines_of(run_sim(joined(run, {"-n", "100", "-q", table})).out);
    };
    for (const std::string table : {"--dump", "--energy"}) {
      if (scene == "scenes/circle.lua" && table == "--energy") continue;
      auto part = rest(table), all = whole(table);
      REQUIRE(part.size() > 40);
      REQUIRE(part.size() < all.size());
      CHECK(part.front() == all.front());
      CHECK(part.back() == all.back());
      std::sort(part.begin(), part.end());  // the systems of a world begin together again
      std::sort(all.begin(), all.end());
      CHECK(std::includes(all.begin(), all.end(), part.begin(), part.end()));
    }
  }
}

TEST_CASE("a checkpoint keeps what the run was made with, and refuses anything else") {
  TemporaryFolder folder;
  const std::string snap = (folder.path() / "a.snap").string();
  REQUIRE(
      run_sim({"scenes/cloth.lua", "euler", "1e-5", "-s", "n=6", "-n", "20", "-q", "--snap", snap})
          .code == 0);
  const std::string bytes = read_text(snap);
  CHECK(run_sim({"--resume", snap, "-n", "30", "-q"}).code == 0);
  CHECK(run_sim({"--resume", snap, "-n", "30", "-q", "-i", "e", "-d", "1e-5", "-s", "n=6"}).code ==
        0);
  for (const std::vector<std::string>& other :
       std::vector<std::vector<std::string>>{{"-i", "rk4"},
                                             {"--precision", "single"},
                                             {"-d", "2e-5"},
                                             {"-s", "n=7"},
                                             {"-s", "shear=51"}}) {
    INFO(other[1]);
    const Outcome outcome = run_sim(joined({"--resume", snap, "-n", "30"}, other));
    CHECK(outcome.code == 6);
    CHECK(outcome.err.starts_with("sim: error: cannot resume: " + snap));
  }
  CHECK(run_sim({"scenes/pendulum.lua", "--resume", snap}).code == 6);
  CHECK(run_sim({"scenes/sample.lua", "--resume", snap}).code == 6);
  CHECK(run_sim({"--resume", snap, "-n", "10"}).code == 2);  // it is beyond that
  CHECK(run_sim({"--resume", (folder.path() / "none").string()}).code == 5);
  CHECK(run_sim({"--resume", folder.path().string()}).code == 5);
  CHECK(run_sim({"-n", "1", "--snap", "/nowhere/a"}).code == 5);
  CHECK(run_sim({"-n", "1", "--snap", snap, "--dump=" + snap}).code == 2);
  write_text(folder.path() / "a.csv", "step,t\n");
  CHECK(run_sim({"--resume", (folder.path() / "a.csv").string()}).code == 6);

  // A run that ends badly replaces nothing.
  CHECK(run_sim({"nowhere.lua", "--snap", snap}).code == 5);
  CHECK(read_text(snap) == bytes);
  CHECK(files_in(folder.path()) == 2);
}

namespace {

// A particle that a function of a module pulls.
void write_pulled(const std::filesystem::path& folder) {
  write_text(folder / "pulled.lua",
             "local sim = require 'sim'\n"
             "local pull = require 'pull'\n"
             "local k = sim.arg('k', 4, 'N/m')\n"
             "local p = sim.particles { mass = 1 }\n"
             "p:add {1, 0, 0}\n"
             "return sim.scene { name = 'pulled', particles = p,\n"
             "  forces = { sim.force.lua { function(t, i, x) return pull(k, x) end } },\n"
             "  integrator = 'rk4', dt = 0.01, duration = 0.2 }\n");
  write_text(folder / "pull.lua", "return function(k, x) return -k * x[1], 0, 0 end\n");
}

}  // namespace

TEST_CASE("a run that goes on with other functions, plugins or arguments says so: unverified") {
  TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  write_pulled(folder.path());
  const std::string plugin = std::string(SIM_FIXTURE_DIR) + "/air_drag/air_drag.so";
  std::filesystem::copy_file(plugin, folder.path() / "mine.so");
  const std::vector<std::string> run{"pulled.lua", "--load", "./mine.so", "-q"};
  REQUIRE(run_sim(joined(run, {"-n", "10", "--snap", "a.snap"}), here).code == 0);
  const auto resumed = [&](std::vector<std::string> more) {
    const Outcome outcome =
        run_sim(joined(joined(run, {"--resume", "a.snap", "-n", "20"}), std::move(more)), here);
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    return outcome.err + outcome.out;
  };
  const auto says = [](const std::string& text, const std::string& words) {
    INFO(text);
    return text.find(words) != std::string::npos;
  };
  CHECK(resumed({}).empty());  // trusted

  // An argument that only a function takes.
  CHECK(says(resumed({"-s", "k=5"}),
             "unverified: changed since a.snap was made: argument k: 4, now 5;"));
  CHECK(says(resumed({"--seed", "7"}), "argument --seed: 0, now 7"));

  // A function, in a module; it stays so in the checkpoints that follow.
  const std::string pull = read_text(folder.path() / "pull.lua");
  write_text(folder.path() / "pull.lua", "return function(k, x) return -2 * k * x[1], 0, 0 end\n");
  CHECK(says(resumed({"--json", "--snap", "b.snap"}), "\"verdict\":\"unverified\""));
  CHECK(says(resumed({}), "module 'pull' ("));
  const Outcome later = run_sim(joined(run, {"--resume", "b.snap", "-n", "30"}), here);
  CHECK(later.code == 0);
  CHECK(says(later.err, "unverified: changed since a.snap was made: module 'pull'"));
  CHECK(says(
      run_sim({"pulled.lua", "--load", "./mine.so", "--resume", "a.snap", "-n", "20"}, here).err,
      "sim: note: changed since a.snap was made: module 'pull'"));
  const Outcome prompt = run_sim({"pulled.lua", "--resume", "a.snap", "-e", ".run 0.1"},
                                 {.program = SIM_REPL_BINARY, .folder = folder.path()});
  CHECK(says(prompt.err, "unverified: changed since a.snap was made: module 'pull'"));
  write_text(folder.path() / "pull.lua", pull);
  CHECK(resumed({}).empty());

  // A plugin that was built again.
  std::string library = read_text(folder.path() / "mine.so");
  library.resize(library.rfind("SIM-PLUGIN-MD5 "));
  write_text(folder.path() / "mine.so", library + "built again");
  CHECK(says(resumed({}), "mine.so)"));

  // A scene that says something else is refused, and it is said what.
  write_text(folder.path() / "pulled.lua",
             std::string(read_text(folder.path() / "pulled.lua")).replace(0, 0, "\n"));
  CHECK(says(resumed({}), "scene ("));
  std::string scene = read_text(folder.path() / "pulled.lua");
  scene.replace(scene.find("mass = 1"), 8, "mass = 2");
  write_text(folder.path() / "pulled.lua", scene);
  const Outcome other = run_sim(joined(run, {"--resume", "a.snap", "-n", "20"}), here);
  CHECK(other.code == 6);
  CHECK(says(other.err, "particles.list"));
}

TEST_CASE("an interrupted run can be gone on with") {
  TemporaryFolder folder;
  const std::string snap = (folder.path() / "a.snap").string();
  const Outcome outcome = run_sim({"-T", "1000", "--every", "1000", "--snap", snap},
                                  {.signal = SIGINT, .signal_at = "drift [J]"});
  CHECK(outcome.code == 130);
  CHECK(run_sim({"--resume", snap, "-T", "1000", "-q"}).code == 0);
}

TEST_CASE("a file without an end is no checkpoint") {
  const Outcome outcome = run_sim({"--resume", "/dev/zero"});
  CHECK(outcome.code == 6);
  CHECK(outcome.err.find("it is not a checkpoint file") != std::string::npos);
}
