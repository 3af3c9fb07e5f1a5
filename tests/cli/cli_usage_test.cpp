// Bad command lines: exit 2 with one error line, before any file is touched.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

using Words = std::vector<std::string>;

// The error line has its shape, and nothing went to standard output.
void check_error(const Words& words, int code, const std::string& part) {
  std::string command = "sim";
  for (const std::string& word : words) command += " '" + word + "'";
  INFO(command);
  const TemporaryFolder folder;
  const Outcome outcome = run_sim(words, {.folder = folder.path()});
  INFO(outcome.err);
  CHECK(outcome.code == code);
  CHECK(outcome.out.empty());
  REQUIRE(lines_of(outcome.err).size() == 1);
  CHECK(outcome.err.rfind("sim: error: ", 0) == 0);
  CHECK(outcome.err.find("; ") != std::string::npos);
  CHECK(outcome.err.find(part) != std::string::npos);
  CHECK(files_in(folder.path()) == 0);
}

TEST_CASE("numbers of the command line are read strictly") {
  for (const std::string option : {"--dt", "-d", "--time", "-T"})
    for (const std::string value : {"nan", "inf", "-inf", "1e400", "-1", "0.1x", "x", "1,5", " 1"})
      check_error({option, value, "--dump=out.csv"}, 2, "'" + value + "'");
  check_error({"--dt", "0"}, 2, "above 0");
  check_error({"scenes/cloth.lua", "r", "nan", "--energy=out.csv"}, 2, "'nan'");
  check_error({"scenes/cloth.lua", "r", "0"}, 2, "above 0");
  for (const std::string option : {"--steps", "--threads", "--every", "--seed", "--debug-particle"})
    for (const std::string value : {"-1", "1.5", "nan", "3x", "99999999999999999999", "1e3"})
      check_error({option, value, "--dump=out.csv"}, 2, "'" + value + "'");
  check_error({"--threads", "0"}, 2, "from 1");
  check_error({"-j", "100000"}, 2, "out of range");
  check_error({"--every", "0"}, 2, "at least 1");
}

TEST_CASE("a run has a length that can be counted") {
  check_error({"--time", "1e300", "--dump=out.csv"}, 2, "too many steps");
  check_error({"--time", "1e14", "--dump=out.csv"}, 2, "too many steps");
  check_error({"--dt", "1e-320", "--dump=out.csv"}, 2, "too many steps");
  check_error({"--steps", "9000000000000001"}, 2, "out of range");
  check_error({"--steps", "1", "--time", "1"}, 2, "--time and --steps");
}

TEST_CASE("integrators take the parameters they declare") {
  check_error({"--tol", "1e-6"}, 2, "choose one that has: auto, bdf, bdf2, bs23, dop853, dopri5");
  check_error({"scenes/cloth.lua", "rk4", "--tol=1e-6"}, 2, "integrator 'rk4' has none");
  check_error({"scenes/cloth.lua", "dopri5", "--tol=1e-20"}, 2, "at least 1e-15");
  check_error({"scenes/cloth.lua", "dopri5", "--tol=2"}, 2, "at most 1");
  check_error({"-i", "dopri5:tol=1e-6", "--tol=1e-6"}, 2, "given twice");
  check_error({"-i", "dopri5", "--tol=1e-6", "--fixed-step"}, 2, "steps of one size");
  check_error({"-i", "dopri5:fixed_step=true,atol=1"}, 2, "nothing uses atol");
  check_error({"-i", "dopri5", "--precision", "single"}, 2, "choose one that has: euler, midpoint");
  check_error({"-i", "rk4", "--precision", "half"}, 2, "it is one of: double, single");
  check_error({"-i", "rk4:precision=single", "--precision=single"}, 2, "given twice");
  check_error({"scenes/circle.lua", "rk4", "--precision=single"}, 3, "springs, gravity and drag");
  check_error({"tradeoff", "--integrators", "precision=single"}, 2, "unknown integrator");
  check_error({"tradeoff", "--integrators", "rk4:precision=single,rk4:precision=single"}, 2,
              "is listed twice");
  check_error({"tradeoff", "--integrators", "rk4,dopri5:atol=1e-6,toll=1"}, 2,
              "it has no parameter 'toll'");
  check_error({"-i", "dopri5:toll=1e-6"}, 2, "did you mean 'tol'?");
  check_error({"-i", "dopri6:tol=1e-6"}, 2, "did you mean 'dopri5'?");
  check_error({"-i", "dopri5:tol=big"}, 2, "tol is 'big'; give a number");
  check_error({"-i", "dopri5:fixed_step=1"}, 2, "true or false");
  check_error({"-i", "dopri5:tol=nan"}, 2, "give a number");
  check_error({"-i", "rk4:tol=1e-6"}, 2, "no parameter 'tol'");
  for (const std::string bad : {"dopri5:", "dopri5:tol", "dopri5:tol=", "dopri5:=1", ":tol=1",
                                "dopri5:tol=1,", "dopri5:tol=1,tol=2"})
    check_error({"-i", bad}, 2, "dopri5:tol=1e-8,max_step=0.1");
}

TEST_CASE("misspelt names are told with the nearest one") {
  check_error({"--integrater", "rk4"}, 2, "did you mean '--integrator'?");
  check_error({"--ener"}, 2, "did you mean '--energy'?");
  check_error({"--tool", "1e-6"}, 2, "unknown option");
  check_error({"--snap", "-"}, 2, "a checkpoint needs a file");
  check_error({"-i", "rk44"}, 2, "did you mean 'rk4'?");
  check_error({"scenes/cloth.lua", "trapezoit"}, 2, "did you mean 'trapezoid'?");
  check_error({"list", "force"}, 2, "did you mean 'forces'?");
  check_error({"describe", "rotatoin"}, 2, "did you mean 'rotation'?");
  check_error({"describe", "cloth"}, 2, "did you mean 'scenes/cloth.lua'?");
  check_error({"--progress", "maybe"}, 2, "auto, on or off");
}

TEST_CASE("words that fit nowhere are told") {
  check_error({"scenes/cloth.lua", "r", "0.1", "more"}, 2, "'more'");
  check_error({"scenes/cloth.lua", "list"}, 2, "sim list does not take it");
  check_error({"list", "--dt", "1"}, 2, "option of a run");
  check_error({"--dt"}, 2, "--dt");
  check_error({"--dt="}, 2, "empty value");
  check_error({"--dt", "0.1", "--dt", "0.2"}, 2, "--dt");
  check_error({"--json=5"}, 2, "json");
  check_error({""}, 2, "empty value");
  check_error({"scenes/cloth.lua", "t", "-i", "r"}, 2, "given twice");
  for (const char* const word : {"n=2", "stiff_k=1e4"})
    check_error({"scenes/pendulum.lua", "-s", "n=3", word}, 2, std::string("write -s ") + word);
  check_error({"scenes/cloth.lua", "t", "0.1", "-d", "0.1"}, 2, "given twice");
  check_error({"adjacency", "scenes/cloth.lua"}, 2, "argument missing");
  check_error({"describe"}, 2, "argument missing");
}

TEST_CASE("a subcommand wins over a scene of its name, ./ reaches the file") {
  const TemporaryFolder folder;
  write_text(folder.path() / "list", read_text(SIM_SOURCE_DIR "/scripts/scenes/circle.lua"));
  const Outcome listed = run_sim({"list", "forces"}, {.folder = folder.path()});
  CHECK(listed.code == 0);
  CHECK(listed.out.rfind("forces\n", 0) == 0);
  const Outcome scene = run_sim({"./list", "-n", "1"}, {.folder = folder.path()});
  CHECK(scene.code == 0);
  CHECK(scene.out.rfind("scene       circle", 0) == 0);
}

TEST_CASE("tables go to places that make sense") {
  check_error({"--dump=out.txt"}, 2, ".csv or .jsonl");
  check_error({"--energy=out"}, 2, ".csv or .jsonl");
  check_error({"--dump="}, 2, "empty value");
  check_error({"--dump", "out.csv"}, 2, "--dump=out.csv");
  check_error({"--dump=a.csv", "--energy=./a.csv"}, 2, "two outputs");
  check_error({"--dump", "--energy"}, 2, "two outputs");
  check_error({"--dump", "--json"}, 2, "standard output");
  check_error({"--debug-particle", "1", "--dump=a.csv"}, 2, "add --time or --steps");
  check_error({"scenes/circle.lua", "--energy=a.csv"}, 2, "first-order scene has no energy");
  check_error({"--dump=/nowhere/at/all.csv"}, 5, "No such file or directory");
}

TEST_CASE("settings are NAME=VALUE and known to the scene") {
  check_error({"--set", "n"}, 2, "NAME=VALUE");
  check_error({"--set", "=3"}, 2, "NAME=VALUE");
  check_error({"--set", "n=3", "-s", "n=4"}, 2, "set twice");
  check_error({"--set", "m=3"}, 2, "n, structural");
  check_error({"--set", "n=abc"}, 2, "abc");
  // The option takes one value: the scene behind it stays a scene.
  CHECK(run_sim({"--set", "n=3", "scenes/cloth.lua", "-n", "1"}).code == 0);
}

TEST_CASE("scenes that are missing or broken") {
  check_error({"scenes/nowhere.lua"}, 5, "nowhere.lua");
  check_error({"/"}, 5, "'/'");
  check_error({"a\nb"}, 5, "not found");
  const TemporaryFolder folder;
  const auto fails = [&](const std::string& text, const std::string& part) {
    write_text(folder.path() / "bad.lua", text);
    const Outcome outcome = run_sim({"bad.lua", "--dump=out.csv"}, {.folder = folder.path()});
    INFO(outcome.err);
    CHECK(outcome.code == 3);
    CHECK(lines_of(outcome.err).size() == 1);
    CHECK(outcome.err.rfind("sim: error: ", 0) == 0);
    CHECK(outcome.err.find(part) != std::string::npos);
    CHECK(files_in(folder.path()) == 1);
  };
  fails("return", "bad.lua");
  fails("this is no Lua", "bad.lua:1");
  fails("local sim = require 'sim'\nreturn sim.sceen {}", "bad.lua:2");
  std::string circle = read_text(SIM_SOURCE_DIR "/scripts/scenes/circle.lua");
  const std::size_t at = circle.find("\"trapezoid\"");
  REQUIRE(at != std::string::npos);
  fails(circle.replace(at, 11, "\"trapezoit\""), "did you mean 'trapezoid'?");
}

TEST_CASE("plugins that cannot be had") {
  check_error({"--plugin-path", "/nowhere"}, 5, "/nowhere");
  const TemporaryFolder folder;
  write_text(folder.path() / "x.so", "no library");
  const Outcome outcome = run_sim({"--load", "x.so"}, {.folder = folder.path()});
  CHECK(outcome.code == 7);
  CHECK(outcome.err.rfind("sim: error: ", 0) == 0);
}

}  // namespace
}  // namespace sim_test
