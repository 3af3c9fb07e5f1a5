// A run that is killed, hung up or fails leaves nothing behind.
#include <catch2/catch.hpp>

#include <sys/file.h>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

const std::vector<std::string> kEndless{"-T", "1e9",        "--dump=d.csv", "--every",
                                        "10", "--progress", "off"};

}  // namespace

TEST_CASE("a run that is killed leaves no file", "[cli][files]") {
  for (const int signal : {SIGKILL, SIGQUIT, SIGABRT}) {
    const TemporaryFolder folder;
    ProgramOptions options;
    options.folder = folder.path();
    options.signal = signal;
    options.signal_at = "particles   64";
    std::vector<std::string> arguments = kEndless;
    arguments.insert(arguments.end(), {"--out", "f.npz", "--energy=e.csv"});
    const Outcome outcome = run_sim(arguments, options);
    CHECK(outcome.code == 128 + signal);
    CHECK(files_in(folder.path()) == 0);
  }
}

TEST_CASE("a run that is hung up ends like one that is interrupted", "[cli][files]") {
  const TemporaryFolder folder;
  ProgramOptions options;
  options.folder = folder.path();
  options.signal = SIGHUP;
  options.signal_at = "particles   64";
  const Outcome outcome = run_sim(kEndless, options);
  CHECK(outcome.code == 128 + SIGHUP);
  CHECK(files_in(folder.path()) == 1);
  CHECK(has(read_text(folder.path() / "d.csv"), "step,t,particle"));
}

TEST_CASE("what a killed program left is collected, what a living one writes is not",
          "[cli][files]") {
  const TemporaryFolder folder;
  write_text(folder.path() / ".sim-999999-0.tmp", "left");
  write_text(folder.path() / ".sim-999999-1.tmp.mp4", "left");
  write_text(folder.path() / ".sim-999998-0.tmp", "held");
  write_text(folder.path() / ".simulation", "of the user");
  const int held = open((folder.path() / ".sim-999998-0.tmp").c_str(), O_RDONLY | O_CLOEXEC);
  REQUIRE(flock(held, LOCK_EX | LOCK_NB) == 0);
  ProgramOptions options;
  options.folder = folder.path();
  CHECK(run_sim({"-n", "1", "--snap", "a.snap"}, options).code == 0);
  CHECK(files_in(folder.path()) == 3);
  CHECK(std::filesystem::exists(folder.path() / ".sim-999998-0.tmp"));
  CHECK(std::filesystem::exists(folder.path() / ".simulation"));
  close(held);
  // Again over the file that is there, which keeps its permissions.
  namespace fs = std::filesystem;
  fs::permissions(folder.path() / "a.snap", fs::perms::owner_read | fs::perms::owner_write);
  CHECK(run_sim({"-n", "2", "--snap", "a.snap"}, options).code == 0);
  CHECK(files_in(folder.path()) == 3);  // with the one before
  CHECK(fs::status(folder.path() / "a.snap").permissions() ==
        (fs::perms::owner_read | fs::perms::owner_write));
}

TEST_CASE("a run that fails after it replaced a file says so", "[cli][files]") {
  const TemporaryFolder folder;
  ProgramOptions options;
  options.folder = folder.path();
  options.program = "/bin/sh";
  const Outcome outcome = run_sim(
      {"-c", std::string("exec '") + SIM_BINARY + "' -n 1 --json --snap a.snap > /dev/full"},
      options);
  CHECK(outcome.code == 5);
  CHECK(has(outcome.err, "written all the same: a.snap"));
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("a series ends where the scene fails", "[cli][files]") {
  const TemporaryFolder folder;
  write_text(folder.path() / "s.lua",
             "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 } p:add {0, 0, 0}\n"
             "return sim.scene { particles = p, forces = { sim.force.lua { function(t) if t > 0.5 "
             "then error('enough') end return 0, 0, 0 end } }, integrator = 'rk4', dt = 0.01, "
             "duration = 1 }\n");
  ProgramOptions options;
  options.folder = folder.path();
  CHECK(run_sim({"s.lua", "--out", "run.pvd"}, options).code == 3);
  CHECK(files_in(folder.path()) == 3);
  CHECK(files_in(folder.path() / "run") > 10);
  CHECK(run_sim({"s.lua", "-T", "0.4", "--out", "run.pvd"}, options).code == 0);
  CHECK(files_in(folder.path()) == 3);
  CHECK(files_in(folder.path() / "run") > 5);
}
