// Each output of a run is written by itself: one that fails costs no other, least of all the
// checkpoint.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class Desk {
 public:
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome sim(const std::vector<std::string>& arguments, std::size_t close_after = 0) const {
    ProgramOptions options;
    options.folder = folder_.path();
    options.close_after = close_after;
    return run_sim(arguments, options);
  }
  // The outcome of a shell in the folder, for which $SIM is the program.
  Outcome shell(const std::string& script) const {
    ProgramOptions options;
    options.folder = folder_.path();
    options.program = "/bin/sh";
    options.environment = {{"SIM", SIM_BINARY}};
    return run_sim({"-c", script}, options);
  }
  std::string text(const std::string& name) const {
    return fs::exists(path(name)) ? read_text(path(name)) : "nothing";
  }

 private:
  TemporaryFolder folder_;
};

// Falls with a force that fails, or is watched by an observer that does.
const std::string kFailing =
    "local sim = require 'sim'\nlocal last = sim.arg('last', 1e9, 's')\n"
    "local seen = sim.arg('seen', 1e9, 's')\n"
    "local p = sim.particles { mass = 1 } p:add {0, 0, 0} p:add {1, 0, 0}\n"
    "return sim.scene { particles = p, forces = { sim.force.lua { function(t, i, x)\n"
    "  if t > last then error('enough') end return -x[1], -9.81, 0.1 * x[3] end,\n"
    "  reads_velocity = false } },\n"
    "  observe = { height = function(s) if s:t() > seen then error('blind') end\n"
    "    return s:position(0)[2] end },\n"
    "  integrator = 'rk4', dt = 0.01, duration = 1 }\n";

std::string last_line(const std::string& text) {
  const auto lines = lines_of(text);
  return lines.empty() ? "" : lines.back();
}

}  // namespace

TEST_CASE("a full or closed standard output costs no checkpoint", "[cli][files]") {
  const Desk desk;
  REQUIRE(desk.sim({"-n", "50", "-q", "--snap", "whole.snap"}).code == 0);
  const std::string whole = desk.text("whole.snap");
  for (const std::string words : {"", "--json", "--dump"}) {
    INFO(words);
    const Outcome full = desk.shell("exec $SIM -n 50 --snap a.snap " + words + " > /dev/full");
    CHECK(full.code == 5);
    CHECK(has(full.err, "sim: error: cannot write: standard output: No space left on device"));
    CHECK(has(full.err, "written all the same: a.snap"));
    CHECK(desk.text("a.snap") == whole);
    fs::remove(desk.path("a.snap"));
  }
  // A reader that goes away ends the run, from where its checkpoint goes on.
  for (const std::string table : {"--dump", "--progress=off"}) {
    fs::remove(desk.path("a.snap"));
    CHECK(desk.sim({"-T", "1e9", "--every", "1", "--snap", "a.snap", table}, 1).code == 141);
    CHECK(desk.sim({"--resume", "a.snap", "--debug-particle", "1"}).code == 0);
  }
  fs::remove(desk.path("a.snap"));
  CHECK(desk.shell("$SIM -n 50 --snap a.snap --every 1 | head -1").code == 0);
  CHECK(fs::exists(desk.path("a.snap")));
  // Nothing is left to run for.
  CHECK(desk.sim({"-T", "1e9", "--dump"}, 1).code == 141);
  CHECK(desk.shell("exec $SIM -T 1e9 --every 1 > /dev/full").code == 5);
}

TEST_CASE("outputs that fail are all said, and cost no other one", "[cli][files]") {
  const Desk desk;
  const Outcome outcome = desk.shell(
      "mkdir gone; $SIM -T 1e9 --every 10 --snap a.snap --energy=e.csv --dump=gone/d.csv "
      "--out gone/f.npz > log 2> err & "
      "until grep -q drift log; do sleep 0.01; done; rm -r gone; kill -INT $!; wait $!");
  CHECK(outcome.code == 5);
  const std::string err = desk.text("err");
  CHECK(has(err, "sim: error: cannot write: gone/d.csv: No such file"));
  CHECK(has(err, "sim: error: cannot write: gone/f.npz: No such file"));
  CHECK(has(err, "written all the same: a.snap, e.csv"));
  CHECK(has(desk.text("e.csv"), "step,t,kinetic"));
  CHECK(desk.sim({"--resume", "a.snap", "--debug-particle", "1"}).code == 0);
}

TEST_CASE("an error of the scene ends a run at its last good step", "[cli][files]") {
  const Desk desk;
  write_text(desk.path("s.lua"), kFailing);
  for (const std::string method : {"rk4", "verlet", "dopri5", "bdf2", "implicit_midpoint"}) {
    INFO(method);
    const Outcome outcome = desk.sim({"s.lua", method, "-s", "last=0.503", "--snap", "a.snap",
                                      "--dump=d.csv", "--observe=o.csv", "--out", "f.npz"});
    CHECK(outcome.code == 3);
    CHECK(has(outcome.err, "enough"));
    CHECK(has(outcome.err, "written all the same: a.snap, d.csv, o.csv, f.npz"));
    // An adaptive method looks further ahead.
    if (method != "dopri5") {
      CHECK(has(outcome.err, "(in step 51 from t = 0.5 s)"));
      CHECK(last_line(desk.text("d.csv")).starts_with("50,0.5,1,"));
      CHECK(last_line(desk.text("o.csv")).starts_with("50,0.5,"));
    }
    // The same bits as the run that does not fail.
    const std::vector<std::string> rest{"s.lua",    "--resume", "a.snap", "-s",
                                        "last=1e9", "-q",       "--dump"};
    const Outcome went_on = desk.sim(rest);
    REQUIRE(went_on.code == 0);
    CHECK(last_line(went_on.out) == last_line(desk.sim({"s.lua", method, "-q", "--dump"}).out));
  }
  // The last moment, seen by an observer that fails there alone.
  const Outcome blind = desk.sim({"s.lua", "-s", "seen=0.995", "--snap", "b.snap", "--dump=d.csv"});
  CHECK(blind.code == 3);
  CHECK(has(blind.err, "blind"));
  CHECK(last_line(desk.text("d.csv")).starts_with("100,1,1,"));
  CHECK(desk.sim({"s.lua", "--resume", "b.snap", "-T", "1.1", "-q", "-s", "seen=2"}).code == 0);
  // A scene that fails at once replaces nothing.
  write_text(desk.path("d.csv"), "mine");
  CHECK(desk.sim({"s.lua", "-s", "seen=-1", "--dump=d.csv", "--observe=o.csv"}).code == 3);
  CHECK(desk.text("d.csv") == "mine");
}
