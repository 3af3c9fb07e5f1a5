// --replay: what hands did comes again with the same bits, in all files; what is no recording is
// refused.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

constexpr const char* kPull =
    "# by hand\nscene scenes/cloth.lua\nset n=6\n+40 grab 35\n"
    "+0 move 35 0.5 -0.4 0.4 over 40\n+60 release 35\n+20 integrator verlet\n+20 pin 20\n";

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

}  // namespace

TEST_CASE("a recording is run again, to the hash at its end") {
  const TemporaryFolder folder;
  const auto in = [&](std::vector<std::string> arguments) {
    return run_sim(arguments, {.folder = folder.path()});
  };
  write(folder.path() / "pull.rec", kPull);
  const Outcome first = in({"--replay", "pull.rec", "--json"});
  INFO(first.err);
  REQUIRE(first.code == 0);
  CHECK(first.err.find("cut off: replayed up to line 8") != std::string::npos);
  CHECK(first.err.find("unverified: ") != std::string::npos);
  CHECK(first.err.find("positions not verified: hands were in it") != std::string::npos);
  const std::size_t at = first.out.find("\"hash\":\"") + 8;
  const std::string hash = first.out.substr(at, 16);

  write(folder.path() / "whole.rec", kPull + ("+0 end " + hash + "\n"));
  const Outcome again =
      in({"--replay", "whole.rec", "-j", "3", "--dump=d.csv", "--out", "a.png", "--every", "10"});
  INFO(again.err);
  CHECK(again.code == 0);
  CHECK(again.err.find("whole.rec replayed: the same bits") != std::string::npos);
  CHECK(std::filesystem::exists(folder.path() / "a.png"));
  CHECK(read_text(folder.path() / "d.csv").find("\n140,") != std::string::npos);

  std::string other = kPull;
  other.replace(other.find("0.5 -0.4"), 3, "0.500000000001");
  write(folder.path() / "other.rec", other + ("+0 end " + hash + "\n"));
  CHECK(in({"--replay", "other.rec"}).code == 8);
  const Outcome settings = in({"--replay", "whole.rec", "-i", "pefrl"});
  CHECK(settings.code == 0);
  CHECK(settings.err.find("not the settings of the recording") != std::string::npos);
}

TEST_CASE("steps are doubled for the verdict also after a hand has held something") {
  const TemporaryFolder folder;
  write(folder.path() / "hold.rec",
        "scene scenes/cloth.lua\n+100 grab 60\n+0 move 60 0.3 -0.4 0.8 over 90\n+400 pin 20\n"
        "+500 end 0000000000000000\n");
  for (const char* method : {"verlet", "rk4", "pefrl"}) {
    INFO(method);
    const Outcome outcome =
        run_sim({"--replay", "hold.rec", "-i", method}, {.folder = folder.path()});
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK(outcome.err.find("hands were in it") != std::string::npos);
  }
}

TEST_CASE("what a session at the prompt changed is run again with the same bits") {
  const TemporaryFolder folder;
  ProgramOptions prompt{.program = SIM_REPL_BINARY, .folder = folder.path()};
  prompt.input =
      ".step 20\n.hand grab 35\n.hand move 35 0.6 -0.2 0.5 over 10\n.step 30\n.pin 12 13\n.undo\n"
      ".hand release 35\n.dt 0.002\n.step 10\n.back 4\nset_velocity(30, {0, 1, 0})\n.step 3\n"
      ".integrator verlet\n.unpin 5\n.step 9\n.reset\n.hand grab 20\n.step 4\n"
      ".hand velocity 20 1 0 0\n.step 8\n.hash\n";
  const Outcome session = run_sim({"-s", "n=6", "--record", "s.rec"}, prompt);
  INFO(session.err);
  REQUIRE(session.code == 0);
  const Outcome again = run_sim({"--replay", "s.rec", "--json"}, {.folder = folder.path()});
  INFO(read_text(folder.path() / "s.rec") << again.err);
  CHECK(again.code == 0);
  CHECK(again.err.find("s.rec replayed: the same bits") != std::string::npos);
  CHECK(again.out.find(session.out.substr(session.out.size() - 17, 16)) != std::string::npos);

  prompt.input = ".branch b\n.switch b\n";
  const Outcome branch = run_sim({"--record", "b.rec"}, prompt);
  CHECK(branch.code == 2);
  CHECK(branch.err.find("not in a recording") != std::string::npos);

  // A world: each system has its own lines.
  prompt.input = ".system cloth\n.step 7\n.pin 40\n.step 5\n.system pendulum\n.pin 2\n.step 6\n";
  REQUIRE(run_sim({"scenes/sample.lua", "--record", "w.rec"}, prompt).code == 0);
  const Outcome world = run_sim({"--replay", "w.rec"}, {.folder = folder.path()});
  INFO(read_text(folder.path() / "w.rec") << world.err);
  CHECK(world.code == 0);
  CHECK(world.err.find("the same bits") != std::string::npos);
}

TEST_CASE("what cannot be replayed is said with its line") {
  const TemporaryFolder folder;
  const auto says = [&](const std::string& text, int code, const std::string& part) {
    write(folder.path() / "r", text);
    const Outcome outcome = run_sim({"--replay", "r"}, {.folder = folder.path()});
    INFO(text << "\n" << outcome.err);
    CHECK(outcome.code == code);
    CHECK(outcome.err.find(part) != std::string::npos);
  };
  const std::string scene = "scene scenes/cloth.lua\n";
  says("+1 grab 1\n", 3, "names no scene");
  says(scene + "+1 grab 64\n", 3, "r:2");
  says(scene + "+1 move 5 0 0 0 over 3\n", 3, "is not held");
  says(scene + "+1 switch wind off\n", 3, "no such switch");
  says(scene + "+1 integrator rk5\n", 3, "r:2");
  says(scene + "+1 left: grab 1\n", 3, "no system 'left'");
  says(scene + "+1 component 0 3\n", 3, "r:2");
  says(scene + "set n\n+1 grab 1\n", 3, "set NAME=VALUE");
  says(scene + "seed x\n+1 grab 1\n", 3, "seed");
  says(scene + "dt -1\n+1 grab 1\n", 3, "dt");
  says(scene + "set size=3\n+1 grab 1\n", 2, "size");
  says("scene /dev/null\n+1 grab 1\n", 5, "not a regular file");
  says("scene nowhere.lua\n+1 grab 1\n", 5, "nowhere");
  says(std::string(1 << 20, '\x80') + "\n", 3, "r:1");
  CHECK(run_sim({"--replay", "/nonexistent"}).code == 5);
  CHECK(run_sim({"--replay", "/"}).code == 5);
  CHECK(run_sim({"--replay", "r", "--time", "3"}).code == 2);
  CHECK(run_sim({"view", "--port", "0"}).code == 2);
  CHECK(run_sim({"view", "--time", "3"}).code == 2);
  CHECK(run_sim({"view", "--record", "/nonexistent/r", "--no-open"}).code == 5);
}
