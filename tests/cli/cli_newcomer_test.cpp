// Commands of somebody who does not know the program yet.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string hash_of(const std::vector<std::string>& words) {
  const Outcome outcome = run_sim(words);
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  const std::size_t at = outcome.out.find("hash        ");
  REQUIRE(at != std::string::npos);
  return outcome.out.substr(at + 12, 16);
}

}  // namespace

TEST_CASE("a verb that is misspelt is not taken for a scene") {
  const Outcome outcome = run_sim({"stabilty", "scenes/cloth.lua"});
  CHECK(outcome.code == 2);
  CHECK(has(outcome.err, "did you mean 'sim stability'?"));
  // A file or a scene of such a name is one.
  const TemporaryFolder folder;
  write_text(folder.path() / "tes", "return 1");
  CHECK(run_sim({"tes"}, {.folder = folder.path()}).code == 3);
  CHECK(run_sim({"rope", "-T", "0.01"}).code == 0);
}

TEST_CASE("sim help takes the beginning of a verb, a plugin, a scene or a function") {
  CHECK(run_sim({"help", "trade"}).out == run_sim({"tradeoff", "--help"}).out);
  CHECK(run_sim({"help", "spring"}).out == run_sim({"describe", "spring"}).out);
  CHECK(run_sim({"help", "sim.grid"}).out == run_sim({"describe", "grid"}).out);
  CHECK(run_sim({"help", "sim.force.spring"}).out == run_sim({"describe", "spring"}).out);
  CHECK(run_sim({"help", "sim.collider.spring"}).code == 2);
  CHECK(has(run_sim({"help", "scenes/rope.lua"}).out, "of that stiffness instead"));
  CHECK(has(run_sim({"help", "stabilty"}).err, "did you mean 'stability'?"));
  CHECK(run_sim({"help", "s"}).code == 2);  // several begin so
}

TEST_CASE("describe knows the functions of the scene language") {
  for (const std::string name : {"sim.grid", "grid", "rigid", "sim.scene", "particles:pin", "at"}) {
    INFO(name);
    const Outcome outcome = run_sim({"describe", name});
    CHECK(outcome.code == 0);
    CHECK(has(outcome.out, name.substr(name.find_last_of(".:") + 1)));
  }
  // A plugin and a function of one name are both shown.
  const std::string sphere = run_sim({"describe", "sphere"}).out;
  CHECK(has(sphere, "collider sphere"));
  CHECK(has(sphere, "sim.sphere { radius = }"));
  CHECK(has(run_sim({"describe", "sim.grid", "--json"}).out, "\"kind\":\"language\""));
  const std::string page = run_sim({"list", "--markdown"}).out;
  for (const char* part :
       {"### sim.grid", "### :pin", "### sim.force.spring", "| `stiffness` | N/m |"})
    CHECK(has(page, part));
}

TEST_CASE("names of integrators may be in capitals, times have units") {
  const std::string hash = hash_of({"-i", "rk4", "-d", "0.005", "-T", "0.1"});
  CHECK(hash_of({"-i", "RK4", "-d", "5ms", "-T", "100ms"}) == hash);
  CHECK(hash_of({"scenes/cloth.lua", "R", "5000 us", "-T", "100 ms"}) == hash);
  // The same bits as the number, for every digit.
  for (const std::string digits : {"1", "3", "7", "0.1", "2.7"})
    CHECK(hash_of({"-d", digits + "ms", "-n", "3", "--no-verify"}) ==
          hash_of({"-d", digits + "e-3", "-n", "3", "--no-verify"}));
  for (const std::string bad : {"5mm", "ms", "5 m s", "nanms", "1e400min"})
    CHECK(run_sim({"-d", bad}).code == 2);
  CHECK(has(run_sim({"-i", "RK9"}).err, "unknown integrator 'RK9'"));

  const auto session = [](const std::string& line) {
    return run_sim({"-e", line, "-e", ".dt"}, {.program = SIM_REPL_BINARY});
  };
  CHECK(session(".dt 2ms").out == "0.002\n");
  CHECK(session(".run 50ms").code == 0);
  CHECK(has(session(".dt 2mm").err, "a step size in s"));
  CHECK(run_sim({"scenes/cloth.lua", "r", "4ms", "-e", ".dt"}, {.program = SIM_REPL_BINARY}).out ==
        "0.004\n");
  CHECK(run_sim({"-e", "particles()"}, {.program = SIM_REPL_BINARY}).out == "64\n");
}

TEST_CASE("a coordinate that is missing is named") {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& vector) {
    write_text(folder.path() / "a.lua", "local sim = require 'sim'\nsim.particles{}:add " + vector);
    return run_sim({"a.lua"}, {.folder = folder.path()}).err;
  };
  CHECK(has(error("{ 0, 0 }"), "a.lua:2: expected a vector {x, y, z} of 3 finite numbers, z is"));
  CHECK(has(error("{ 0 }"), "y is missing"));
  CHECK(has(error("{}"), "x is missing"));
  CHECK(has(error("{ 0, 'a', 0 }"), "of 3 finite numbers, got "));
}

TEST_CASE("sweeps take linN, and say how far one came") {
  const auto cases = [](const std::string& values) {
    return run_sim({"sweep", "scenes/pendulum.lua", "--over", "dt=" + values, "--list"}).out;
  };
  CHECK(cases("0.001:0.02:lin8") == cases("0.001:0.02:8"));
  CHECK(run_sim({"sweep", "--over", "dt=0.1:0.2:lin"}).code == 2);
  const TemporaryFolder folder;
  const Outcome stopped = run_sim(
      {"-c", "timeout -s INT 3 " SIM_BINARY " sweep scenes/pendulum.lua --over "
             "dt=0.001,0.0000001 --out a.csv -T 10 --no-verify"},
      {.program = "/bin/sh", .folder = folder.path(), .environment = {{"PATH", "/usr/bin:/bin"}}});
  INFO(stopped.err);
  CHECK(has(stopped.err, "1 of 2 cases, 1 missing"));
  CHECK(has(stopped.err, "the same command goes on from here"));
}

TEST_CASE("what draws a chart is said where a picture was asked for") {
  const Outcome outcome = run_sim({"--out", "x.svg"});
  CHECK(outcome.code == 2);
  for (const char* part : {"--energy=x.svg", "sim tradeoff --svg", "sim plot"})
    CHECK(has(outcome.err, part));
}

TEST_CASE("doctor names optional parts that are absent, and their packages") {
  const TemporaryFolder folder;
  const Outcome outcome = run_sim({"doctor"}, {.environment = {{"PATH", folder.path().string()}}});
  CHECK(outcome.code == 0);
  CHECK(has(outcome.out, "absent ffmpeg       films; install ffmpeg\n"));
  CHECK(has(outcome.out, "absent lammps       --engine lammps; needs the package lammps\n"));
  CHECK(has(outcome.out, "absent MPI          --ranks; install openmpi-bin\n"));
  CHECK(has(outcome.out, "all is well"));
  CHECK(has(run_sim({"doctor", "--json"}, {.environment = {{"PATH", folder.path().string()}}}).out,
            "{\"check\":\"ffmpeg\",\"ok\":true,\"absent\":true"));
}
