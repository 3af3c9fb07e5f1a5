// Files of a run that grow, and files that belong together: whole, or as they were before.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

namespace fs = std::filesystem;
using Catch::Contains;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

}  // namespace

TEST_CASE("a session that does not start leaves an older recording alone", "[cli][files]") {
  const TemporaryFolder folder;
  write_text(folder.path() / "a.rec", "an older one");
  const auto old_one_stays = [&](const std::string& program,
                                 const std::vector<std::string>& arguments, int code) {
    const Outcome outcome =
        run_sim(arguments, {.program = program, .input = ".step 1\n", .folder = folder.path()});
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK(read_text(folder.path() / "a.rec") == "an older one");
    CHECK(files_in(folder.path()) == 1);
  };
  old_one_stays(SIM_REPL_BINARY, {"no.lua", "--record", "a.rec"}, 5);
  old_one_stays(SIM_REPL_BINARY, {"--record", "a.rec", "--init", "no.lua"}, 5);
  old_one_stays(SIM_BINARY, {"view", "--record", "a.rec", "--terminal"}, 5);
  const Outcome taken =
      run_sim({"--record", "a.rec"},
              {.program = SIM_REPL_BINARY, .input = ".pin 12\n.step 3\n", .folder = folder.path()});
  CHECK(taken.code == 0);
  CHECK_THAT(read_text(folder.path() / "a.rec"), Contains("+0 pin 12\n+3 end "));
}

#ifdef SIM_SMALL_MACHINE
TEST_CASE("a recording for which the disk has no room is said at once, and is whole before that",
          "[cli][files]") {
  const TemporaryFolder folder;
  ProgramOptions options{.program = SIM_REPL_BINARY,
                         .input = ".pin 12\n.pin 13\n.pin 14\n.step 2\nprint('later')\n",
                         .folder = folder.path()};
  options.environment = {{"LD_PRELOAD", SIM_SMALL_MACHINE}, {"SMALL_DISK", "80"}};
  const Outcome outcome = run_sim({"--record", "a.rec"}, options);
  INFO(outcome.err);
  CHECK(outcome.code == 5);
  CHECK_THAT(outcome.out, Contains("later"));
  CHECK_THAT(outcome.err, Contains("cannot write: a.rec: No space left on device; its first "));
  CHECK(outcome.err.find("No space") == outcome.err.rfind("No space"));
  const std::string kept = read_text(folder.path() / "a.rec");
  INFO(kept);
  CHECK(kept.ends_with("\n"));
  CHECK_THAT(kept, Contains("+0 pin 12\n"));
  const Outcome again = run_sim({"--replay", "a.rec"}, {.folder = folder.path()});
  CHECK(again.code == 0);

  // Its lines are counted.
  std::size_t fewest = 99, most = 0;
  for (int room = 66; room <= 110; room += 4) {
    CAPTURE(room);
    const TemporaryFolder own;
    options.folder = own.path();
    options.environment.back().second = std::to_string(room);
    const std::string said = run_sim({"--record", "b.rec"}, options).err;
    const std::string text = read_text(own.path() / "b.rec");
    const auto lines = static_cast<std::size_t>(std::ranges::count(text, '\n'));
    const std::string first = lines == 1 ? "line is" : std::to_string(lines) + " lines are";
    CHECK_THAT(said, Contains("its first " + first + " kept"));
    fewest = std::min(fewest, lines), most = std::max(most, lines);
  }
  CHECK(fewest + 1 < most);

  options.folder = folder.path();
  options.environment.back().second = "10";
  write_text(folder.path() / "a.rec", "an older one");
  CHECK(run_sim({"--record", "a.rec"}, options).code == 5);
  CHECK(read_text(folder.path() / "a.rec") == "an older one");
}

TEST_CASE("a series for which the disk has no room leaves the older one", "[cli][files]") {
  const TemporaryFolder folder;
  ProgramOptions options{.folder = folder.path()};
  const std::vector<std::string> arguments{"-q",    "-T",      "0.1", "--out",  "p-%d.png", "--out",
                                           "s.pvd", "--every", "5",   "--size", "64x64"};
  REQUIRE(run_sim(arguments, options).code == 0);
  const std::vector<std::string> before = names_in(folder.path());
  const std::string picture = read_text(folder.path() / "p-0.png"),
                    points = read_text(folder.path() / "s" / "s_00000.vtp");
  options.environment = {{"LD_PRELOAD", SIM_SMALL_MACHINE}, {"SMALL_DISK", "150000"}};
  std::vector<std::string> other = arguments;
  other.insert(other.end(), {"-s", "n=16"});
  const Outcome full = run_sim(other, options);
  INFO(full.err);
  CHECK(full.code == 5);
  CHECK(names_in(folder.path()) == before);
  CHECK(read_text(folder.path() / "p-0.png") == picture);
  CHECK(read_text(folder.path() / "s" / "s_00000.vtp") == points);
  CHECK(files_in(folder.path() / "s") == 5);
}

TEST_CASE("an export for which the disk has no room leaves the older one", "[cli][files]") {
  const TemporaryFolder folder;
  ProgramOptions options{.folder = folder.path()};
  REQUIRE(
      run_sim({"export", "scenes/cloth.lua", "e", "--format", "lammps", "-i", "verlet"}, options)
          .code == 0);
  std::vector<std::pair<std::string, std::string>> before;
  for (const std::string& name : names_in(folder.path() / "e"))
    before.emplace_back(name, read_text(folder.path() / "e" / name));
  REQUIRE(before.size() > 2);
  write_text(folder.path() / "e" / "mine.txt", "of the user");
  options.environment = {{"LD_PRELOAD", SIM_SMALL_MACHINE}, {"SMALL_DISK", "9000"}};
  const Outcome full = run_sim(
      {"export", "scenes/cloth.lua", "e", "--format", "lammps", "-i", "verlet", "-s", "n=16"},
      options);
  INFO(full.err);
  CHECK(full.code == 5);
  for (const auto& [name, text] : before) CHECK(read_text(folder.path() / "e" / name) == text);
  CHECK(files_in(folder.path() / "e") == before.size() + 1);
  const Outcome fresh = run_sim(
      {"export", "scenes/cloth.lua", "f", "--format", "lammps", "-i", "verlet", "-s", "n=16"},
      options);
  CHECK(fresh.code == 5);
  CHECK(!fs::exists(folder.path() / "f"));
}
#endif

TEST_CASE("a shorter series leaves no frames of a longer one", "[cli][files]") {
  const TemporaryFolder folder;
  const ProgramOptions options{.folder = folder.path()};
  const auto run = [&](const char* time) {
    CHECK(run_sim({"-q", "-T", time, "--out", "p-%03d.png", "--out", "s.pvd", "--every", "5",
                   "--size", "64x64"},
                  options)
              .code == 0);
  };
  run("0.2");
  CHECK(files_in(folder.path() / "s") == 9);
  write_text(folder.path() / "s" / "mine.vtp", "of the user");
  write_text(folder.path() / "p-mine.png", "of the user");
  run("0.1");
  CHECK(names_in(folder.path()) == std::vector<std::string>{"p-000.png", "p-001.png", "p-002.png",
                                                            "p-003.png", "p-004.png", "p-mine.png",
                                                            "s", "s.pvd"});
  CHECK(files_in(folder.path() / "s") == 6);
}

TEST_CASE("the folder of a series that was killed is collected", "[cli][files]") {
  const TemporaryFolder folder;
  const ProgramOptions options{.folder = folder.path()};
  fs::create_directories(folder.path() / "s" / ".sim-999999.tmpABCDEF");
  write_text(folder.path() / "s" / ".sim-999999.tmpABCDEF" / "s_00000.vtp", "left");
  CHECK(run_sim({"-q", "-n", "1", "--out", "s.pvd"}, options).code == 0);
  CHECK(names_in(folder.path() / "s") == std::vector<std::string>{"s_00000.vtp", "s_00001.vtp"});
}
