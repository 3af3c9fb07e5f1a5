// No command replaces what it reads, and no file is written twice: refused before anything is
// opened.
#include <catch2/catch.hpp>

#include "core/base/error.h"
#include "core/output/file_plan.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

namespace fs = std::filesystem;

constexpr const char* kScene =
    "local sim = require 'sim'\nlocal part = require 'part'\n"
    "local n = sim.arg('n', 1, 'particles')\n"
    "local p = sim.particles { mass = 1 }\nfor i = 1, n do p:add { i, part, 0 } end\n"
    "return sim.scene { particles = p, forces = { sim.force.gravity {} },\n"
    "  integrator = 'rk4', dt = 0.01, duration = 0.1 }\n";

// A folder with a scene, a module, a table of cases and a checkpoint.
class Desk {
 public:
  Desk() {
    write_text(path("mine.lua"), kScene);
    write_text(path("part.lua"), "return 2\n");
    write_text(path("c.csv"), "n\n1\n2\n");
    write_text(path("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    REQUIRE(sim({"mine.lua", "-i", "verlet", "-n", "1", "-q", "--snap", "a.snap"}).code == 0);
    REQUIRE(repl({"mine.lua", "--record", "r.rec", "-e", ".step 3"}).code == 0);
  }

  fs::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome sim(const std::vector<std::string>& arguments) const {
    ProgramOptions options;
    options.folder = folder_.path();
    return run_sim(arguments, options);
  }
  Outcome repl(const std::vector<std::string>& arguments) const {
    ProgramOptions options;
    options.folder = folder_.path();
    options.program = SIM_REPL_BINARY;
    return run_sim(arguments, options);
  }

  // Every file below the folder, with what is in it.
  std::map<std::string, std::string> contents() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path()))
      if (entry.is_regular_file()) all[entry.path().string()] = read_text(entry.path());
    return all;
  }

 private:
  TemporaryFolder folder_;
};

void check_refused(const Desk& desk, const std::vector<std::string>& arguments,
                   bool prompt = false) {
  std::string command;
  for (const std::string& argument : arguments) command += argument + " ";
  INFO(command);
  const auto before = desk.contents();
  const Outcome outcome = prompt ? desk.repl(arguments) : desk.sim(arguments);
  INFO(outcome.err);
  CHECK(outcome.code == 2);
  CHECK((outcome.err.find("an output would replace an input") != std::string::npos ||
         outcome.err.find("two outputs for one file") != std::string::npos));
  CHECK(desk.contents() == before);
}

bool conflicts(const fs::path& one, const fs::path& other) {
  sim::FilePlan plan;
  plan.writes("one", one.string());
  plan.writes("other", other.string());
  try {
    plan.check();
    return false;
  } catch (const sim::Error& error) {
    CHECK(error.kind() == sim::ErrorKind::kUsage);
    return true;
  }
}

}  // namespace

TEST_CASE("a run replaces nothing that it reads") {
  const Desk desk;
  fs::create_symlink("mine.lua", desk.path("link.csv"));
  fs::create_hard_link(desk.path("mine.lua"), desk.path("hard.csv"));
  fs::create_directory(desk.path("sub"));
  fs::create_directory_symlink(".", desk.path("here"));
  for (const std::string file : {"mine.lua", "./mine.lua", "sub/../mine.lua", "here/mine.lua",
                                 "link.csv", "hard.csv", "part.lua", "here/part.lua"})
    check_refused(desk, {"mine.lua", "-n", "1", "--snap", file});
  for (const std::string table : {"--dump", "--energy", "--observe"})
    check_refused(desk, {"mine.lua", "-n", "1", table + "=hard.csv"});
  check_refused(desk, {"mine.lua", "-n", "1", "--out", "link.csv"});
  check_refused(desk, {"mine.lua", "--replay", "r.rec", "--snap", "r.rec"});
  check_refused(desk, {"mine.lua", "--resume", "a.snap", "--energy=a.csv", "--dump=./a.csv"});
  fs::create_symlink("a.snap", desk.path("snap.csv"));
  check_refused(desk, {"mine.lua", "-n", "2", "--resume", "a.snap", "--dump=snap.csv"});
  fs::copy_file(fs::path(SIM_FIXTURE_DIR) / "attraction/attraction.so", desk.path("x.so"));
  check_refused(desk, {"mine.lua", "-n", "1", "--plugin-path", ".", "--snap", "x.so"});
  // A run may go on from the checkpoint that it replaces.
  CHECK(desk.sim({"mine.lua", "-n", "2", "--resume", "a.snap", "--snap", "./a.snap"}).code == 0);
}

TEST_CASE("no file is two outputs of a run, whatever its writers call it") {
  const Desk desk;
  fs::create_directory(desk.path("sub"));
  fs::create_directory_symlink("sub", desk.path("also"));
  fs::create_symlink("sub/new.csv", desk.path("soon.csv"));
  const auto refused = [&](std::vector<std::string> outputs) {
    outputs.insert(outputs.begin(), {"mine.lua", "-n", "1"});
    check_refused(desk, outputs);
  };
  refused({"--energy=a.csv", "--out", "a.csv"});
  refused({"--energy=sub/a.csv", "--dump=also/a.csv"});
  refused({"--energy=soon.csv", "--dump=sub/new.csv"});
  refused({"--snap", "a", "--out", "a.npz", "--energy=./a.csv", "--dump=a.csv"});
  refused({"--out", "f-%04d.png", "--out", "f-0003.png"});
  refused({"--out", "f-%04d.png", "--out", "f-%d.png"});
  refused({"--out", "run.pc2", "--out", "run.obj"});
  refused({"--out", "run.pvd", "--out", "run/run_00000.vtp"});
  refused({"--dump", "--energy"});
  fs::create_symlink("../mine.lua", desk.path("sub/f-0002.png"));
  refused({"--out", "sub/f-%04d.png"});
  CHECK(desk.sim({"mine.lua", "-n", "1", "--energy=/dev/null", "--dump=/dev/null"}).code == 0);
  // A link that leads to no file yet is left as it is.
  CHECK(desk.sim({"mine.lua", "-n", "1", "--energy=soon.csv"}).code == 0);
  CHECK(fs::is_symlink(desk.path("soon.csv")));
  CHECK(fs::is_regular_file(desk.path("sub/new.csv")));
}

TEST_CASE("standard output that was led into a file is an output, too") {
  const Desk desk;
  ProgramOptions options;
  options.folder = desk.path("");
  options.program = "/bin/sh";
  const auto shell = [&](const std::string& words) {
    return run_sim({"-c", "exec '" + std::string(SIM_BINARY) + "' mine.lua -n 1 " + words},
                   options);
  };
  CHECK(shell("--energy=a.csv > a.csv").code == 2);
  CHECK(shell("--snap b >> b").code == 2);
  CHECK(shell(">> part.lua").code == 2);
  CHECK(read_text(desk.path("part.lua")) == "return 2\n");
  CHECK(shell("--energy --snap c.snap > c.csv").code == 0);
}

TEST_CASE("no other command replaces what it reads") {
  const Desk desk;
  fs::create_hard_link(desk.path("mine.lua"), desk.path("hard.csv"));
  fs::create_hard_link(desk.path("mine.lua"), desk.path("hard.svg"));
  fs::create_hard_link(desk.path("m.obj"), desk.path("m.lua"));
  fs::create_hard_link(desk.path("c.csv"), desk.path("c.svg"));
  fs::create_directory(desk.path("runs.cases"));
  fs::create_symlink("../mine.lua", desk.path("runs.cases/000001.csv"));
  check_refused(desk, {"sweep", "mine.lua", "--cases", "c.csv", "--out", "c.csv"});
  check_refused(desk, {"sweep", "mine.lua", "--over", "n=1,2", "--out", "hard.csv"});
  check_refused(desk, {"sweep", "mine.lua", "--over", "n=1,2", "--out", "runs.csv"});
  check_refused(desk, {"plot", "c.csv", "-x", "n", "-y", "n"});
  check_refused(desk, {"import", "m.obj", "--out", "m.lua"});
  check_refused(desk, {"rest", "mine.lua", "--dump=hard.csv"});
  check_refused(desk, {"tradeoff", "mine.lua", "--csv", "hard.csv"});
  check_refused(desk, {"tradeoff", "mine.lua", "--csv", "a.csv", "--svg", "a.csv"});
  check_refused(desk, {"stability", "mine.lua", "--svg", "mine.lua"});
  check_refused(desk, {"compare", "mine.lua", "-i", "rk4", "-i", "euler", "--out", "hard.csv"});
  check_refused(desk, {"view", "mine.lua", "--record", "mine.lua"});
  check_refused(desk, {"view", "mine.lua", "--record", "part.lua"});
  fs::create_directory(desk.path("x"));
  fs::rename(desk.path("a.snap"), desk.path("x/start.snap"));
  check_refused(desk, {"export", "mine.lua", "--resume", "x/start.snap", "-n", "2", "--format",
                       "lammps", "x"});
}

TEST_CASE("a session replaces nothing that it reads") {
  const Desk desk;
  write_text(desk.path("s.txt"), ".step 1\n");
  check_refused(desk, {"mine.lua", "--record", "mine.lua", "-e", ".step"}, true);
  check_refused(desk, {"mine.lua", "--record", "s.txt", "-f", "s.txt"}, true);
  fs::create_hard_link(desk.path("mine.lua"), desk.path("hard.csv"));
  for (const std::string line :
       {".save mine.lua", ".save part.lua", ".snap mine.lua", ".dump hard.csv", ".show hard.csv"})
    check_refused(desk, {"mine.lua", "-e", line}, true);
  check_refused(desk, {"mine.lua", "-f", "s.txt", "-e", ".save s.txt"}, true);
  const Outcome outcome = desk.repl({"mine.lua", "--record", "r2", "-e", ".save r2"});
  CHECK(outcome.code == 2);
  CHECK(read_text(desk.path("r2")).find("scene mine.lua") != std::string::npos);
}

TEST_CASE("files that are not there yet are compared by their folder and name") {
  const TemporaryFolder folder;
  const fs::path at = folder.path();
  fs::create_directory(at / "a");
  fs::create_directory_symlink("a", at / "b");
  fs::create_symlink("a/c", at / "d");
  fs::create_symlink("d", at / "e");
  fs::create_symlink("loop", at / "loop");
  CHECK(conflicts(at / "a/c", at / "b/c"));
  CHECK(conflicts(at / "a/c", at / "d"));
  CHECK(conflicts(at / "b/../a/c", at / "e"));
  CHECK(conflicts(at / "a/new/c", at / "b/new/./c"));
  CHECK(conflicts(at / "loop", at / "loop"));
  CHECK(conflicts(at / "x%dy", at / "x1%dy"));
  CHECK_FALSE(conflicts(at / "a/c", at / "c"));
  CHECK_FALSE(conflicts(at / "x%d.png", at / "x.png"));
  CHECK_FALSE(conflicts(at / "x%d.png", at / "xa%d.png"));
  CHECK_FALSE(conflicts("/dev/null", "/dev/null"));
}
