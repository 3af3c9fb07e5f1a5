// Files that a user names and that have no end, no writer or no room in memory: refused by name.
#include <sys/stat.h>

#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

namespace fs = std::filesystem;
using Catch::Contains;

struct Reading {
  std::string name;  // of the file, with the ending that the command wants
  std::vector<std::string> arguments;
  std::string larger;
};

std::vector<Reading> readings() {
  return {{"a.obj", {"import", "a.obj"}, "it is larger than 1 GB"},
          {"a.ply", {"import", "a.ply"}, "it is larger than 1 GB"},
          {"a.rec", {"--replay", "a.rec"}, "it is larger than 256 MB"},
          {"a.csv", {"plot", "a.csv", "-x", "a", "-y", "b"}, "it is larger than 256 MB"},
          {"a.csv", {"sweep", "--cases", "a.csv"}, "it is larger than 256 MB"},
          {"a.lua", {"a.lua"}, "it is larger than 64 MB"},
          {"a.snap", {"--resume", "a.snap"}, "it is not a checkpoint file"}};
}

}  // namespace

TEST_CASE("what is no regular file, or too large, is refused before it is read", "[cli]") {
  for (const Reading& each : readings()) {
    const TemporaryFolder folder;
    const fs::path file = folder.path() / each.name;
    const ProgramOptions here{.folder = folder.path()};
    INFO(each.arguments[0] << " " << each.name);
    const bool resume = each.name == "a.snap";
    const auto refused = [&](const std::string& why) {
      const Outcome outcome = run_sim(each.arguments, here);
      INFO(outcome.err);
      CHECK(outcome.code == (resume ? 6 : 5));
      CHECK_THAT(outcome.err, Contains(each.name) && Contains(why));
      fs::remove(file);
    };
    REQUIRE(mkfifo(file.c_str(), 0600) == 0);
    refused("not a regular file");
    for (const char* device : {"/dev/zero", "/dev/random"}) {
      fs::create_symlink(device, file);
      refused("not a regular file");
    }
    write_text(file, "");
    fs::resize_file(file, std::uintmax_t{100} << 30);
    refused(each.larger);
  }
}

TEST_CASE("a huge file that begins as a checkpoint does is refused", "[cli]") {
  const TemporaryFolder folder;
  const ProgramOptions here{.folder = folder.path()};
  REQUIRE(run_sim({"-q", "-n", "1", "--snap", "a.snap"}, here).code == 0);
  fs::resize_file(folder.path() / "a.snap", std::uintmax_t{10} << 40);
  const Outcome outcome = run_sim({"--resume", "a.snap"}, here);
  CHECK(outcome.code == 5);
  CHECK_THAT(outcome.err, Contains("it is larger than "));
}

TEST_CASE("files of a session and of an engine are looked at before they are read", "[cli]") {
  const TemporaryFolder folder;
  ProgramOptions here{.folder = folder.path()};
  REQUIRE(run_sim({"export", "scenes/cloth.lua", "e", "-i", "verlet", "-q"}, here).code == 0);
  for (const char* name : {"frames.bin", "log.lammps"}) {
    REQUIRE(mkfifo((folder.path() / "e" / name).c_str(), 0600) == 0);
    const Outcome outcome = run_sim({"import", "e"}, here);
    CHECK(outcome.code == 5);
    CHECK_THAT(outcome.err, Contains("not a regular file"));
    fs::remove(folder.path() / "e" / name);
  }
  REQUIRE(mkfifo((folder.path() / "s.txt").c_str(), 0600) == 0);
  here.program = SIM_REPL_BINARY;
  here.input = ".read s.txt\n";
  const Outcome outcome = run_sim({}, here);
  CHECK(outcome.code == 5);
  CHECK_THAT(outcome.err, Contains("s.txt: it is not a regular file"));
}
