// Checkpoints while a run goes, what is kept of an older one, and those of runs that diverge.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Words operator+(Words list, const Words& more) {
  list.insert(list.end(), more.begin(), more.end());
  return list;
}

class Desk {
 public:
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome sim(const Words& arguments) const {
    ProgramOptions options;
    options.folder = folder_.path();
    return run_sim(arguments, options);
  }
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
  // The lines with the hashes of a run, which has to succeed.
  std::string hash(const Words& arguments) const {
    const Outcome outcome = sim(arguments + Words{"--no-verify"});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    std::string found;
    for (const std::string& line : lines_of(outcome.out))
      if (line.starts_with("hash")) found += line + "\n";
    REQUIRE(!found.empty());
    return found;
  }

 private:
  TemporaryFolder folder_;
};

std::string line_with(const std::string& text, const std::string& part) {
  for (const std::string& line : lines_of(text))
    if (has(line, part)) return line;
  return "no line";
}

}  // namespace

TEST_CASE("checkpoints on the way change no bit, and a run goes on from each", "[cli][files]") {
  const Desk desk;
  for (const Words& run :
       std::vector<Words>{{"scenes/cloth.lua", "rk4", "-s", "n=20", "-n", "3000"},
                          {"scenes/cloth.lua", "verlet", "-s", "n=20", "-n", "3000"},
                          {"scenes/cloth.lua", "rk4:precision=single", "-n", "3000"},
                          {"scenes/cloth.lua", "dopri5", "--tol", "1e-7", "-n", "300"},
                          {"scenes/cloth.lua", "bdf2", "-n", "150"},
                          {"scenes/cloth.lua", "trbdf2", "--tol", "1e-4", "-n", "60"},
                          {"scenes/cloth.lua", "implicit_euler", "-n", "150"},
                          {"scenes/circle.lua", "dopri5", "-n", "300"},
                          {"scenes/bounce.lua", "-n", "60"},
                          {"scenes/sample.lua", "-n", "200"}}) {
    INFO(run[0] << " " << run[1]);
    const std::string whole = desk.hash(run);
    fs::remove(desk.path("a.snap"));
    CHECK(desk.hash(run + Words{"--snap", "a.snap", "--snap-every", "1e-9s"}) == whole);
    // Killed on the way, as soon as there is a checkpoint.
    fs::remove(desk.path("a.snap"));
    std::string words;
    for (const std::string& word : run) words += " " + word;
    desk.shell("$SIM" + words +
               " -q --no-verify --snap a.snap --snap-every 1ms & "
               "until test -e a.snap; do sleep 0.01; done; kill -9 $!; wait $!");
    CHECK(desk.hash({run[0], "--resume", "a.snap", "-n", run.back()}) == whole);
  }
}

TEST_CASE("what stood in the file of a checkpoint is kept", "[cli][files]") {
  const Desk desk;
  REQUIRE(desk.sim({"-n", "10", "-q", "--snap", "a.snap"}).code == 0);
  CHECK_FALSE(fs::exists(desk.path("a.snap.prev")));
  const std::string first = desk.text("a.snap");
  REQUIRE(desk.sim({"-n", "400", "-q", "--snap", "a.snap", "--snap-every", "1e-6"}).code == 0);
  const std::string second = desk.text("a.snap");
  CHECK(second != first);
  CHECK(desk.text("a.snap.prev") == first);
  REQUIRE(desk.sim({"-n", "500", "-q", "--resume", "a.snap", "--snap", "a.snap"}).code == 0);
  CHECK(desk.text("a.snap.prev") == second);
  CHECK(files_in(desk.path("")) == 2);
  // The older file under both names already, and a link to one elsewhere.
  fs::remove(desk.path("a.snap.prev"));
  fs::create_hard_link(desk.path("a.snap"), desk.path("a.snap.prev"));
  const std::string third = desk.text("a.snap");
  REQUIRE(desk.sim({"-n", "20", "-q", "--snap", "a.snap"}).code == 0);
  CHECK(desk.text("a.snap.prev") == third);
  fs::create_directory(desk.path("far"));
  write_text(desk.path("far/b"), "older");
  fs::create_symlink("far/b", desk.path("b"));
  REQUIRE(desk.sim({"-n", "20", "-q", "--snap", "b"}).code == 0);
  CHECK(desk.text("b.prev") == "older");
  CHECK(fs::is_symlink(desk.path("b")));
  CHECK(desk.text("far/b") == desk.text("a.snap"));
  // A run that cannot keep it does not begin.
  fs::create_directory(desk.path("c.prev"));
  write_text(desk.path("c"), "older");
  CHECK(desk.sim({"-n", "20", "-q", "--snap", "c"}).code == 5);
  CHECK(desk.text("c") == "older");
  CHECK(desk.sim({"-n", "20", "--resume", "a.snap.prev", "--snap", "a.snap"}).code == 2);
  CHECK(desk.sim({"-n", "20", "-q", "--snap", "/dev/null"}).code == 0);
}

TEST_CASE("a run that diverges leaves its last good state and the last one", "[cli][files]") {
  const Desk desk;
  write_text(desk.path("stiff.lua"),
             "local sim = require 'sim'\nreturn sim.scene { state = { 1 }, integrator = 'rk4',\n"
             "  dt = 0.001, duration = 50, field = sim.field.lua { function(t, x)\n"
             "    return { -1000 * x[1] } end } }\n");
  for (const Words& run : std::vector<Words>{{"scenes/cloth.lua", "euler", "0.01"},
                                             {"scenes/cloth.lua", "rk4", "0.03", "-T", "20"},
                                             {"scenes/cloth.lua", "verlet", "0.05", "-T", "50"},
                                             {"stiff.lua", "euler", "0.01", "-T", "50"}}) {
    INFO(run[0] << " " << run[1]);
    const Outcome outcome = desk.sim(run + Words{"--snap", "a.snap"});
    REQUIRE(outcome.code == 4);
    INFO(outcome.err);
    CHECK(has(outcome.err, "a.snap has the last good state, at t = "));
    CHECK(has(outcome.err, "the one that diverged is in a.snap.diverged"));
    for (const std::string file : {"a.snap", "a.snap.diverged"}) {
      Words rest{run[0], "--resume", file, "--no-verify"};
      if (run.size() > 3) rest = rest + Words{run[3], run[4]};
      const Outcome again = desk.sim(rest);
      CHECK((again.code == 4 || file != "a.snap"));
      CHECK(line_with(again.out, "hash") == line_with(outcome.out, "hash"));
    }
  }
}

TEST_CASE("the interval of checkpoints is a time above 0", "[cli]") {
  const Desk desk;
  for (const std::string bad :
       {"0", "0s", "-1s", "nan", "inf", "1e400", "1e308h", "5 parsecs", "s", "30s 5", "1d", "0x"}) {
    INFO(bad);
    const Outcome outcome = desk.sim({"-n", "1", "--snap", "a.snap", "--snap-every", bad});
    CHECK(outcome.code == 2);
    CHECK(has(outcome.err, "--snap-every"));
    CHECK(files_in(desk.path("")) == 0);
  }
  CHECK(desk.sim({"-n", "1", "--snap-every", "30s"}).code == 2);
  for (const std::string good : {"30s", "5min", "1h", "250ms", "2", "1e-300", "1e300"})
    CHECK(desk.sim({"-n", "1", "-q", "--snap", "a.snap", "--snap-every", good}).code == 0);
}
