// Signals to real runs: nothing but KILL loses the checkpoint.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

namespace fs = std::filesystem;

class Desk {
 public:
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  // The outcome of a shell in the folder, where `run` is a run without an end that has begun.
  Outcome shell(const std::string& script) const {
    ProgramOptions options;
    options.folder = folder_.path();
    options.program = "/bin/bash";
    options.environment = {{"SIM", SIM_BINARY}};
    return run_sim({"-c",
                    "begun() { until grep -q drift log 2> /dev/null; do sleep 0.01; done; }\n"
                    "run() { \"$SIM\" -T 1e9 --every 1000 --snap a.snap \"$@\" > log 2> err & }\n" +
                        script},
                   options);
  }
  bool good_checkpoint() const {
    ProgramOptions options;
    options.folder = folder_.path();
    return run_sim({"--resume", "a.snap", "--debug-particle", "1"}, options).code == 0;
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace

TEST_CASE("signals that come together end a run once, with its checkpoint", "[cli][signals]") {
  for (const std::string signals :
       {"TERM TERM", "INT INT INT INT", "HUP TERM", "TERM CONT TERM", "QUIT", "USR1", "XCPU"}) {
    const Desk desk;
    INFO(signals);
    std::string script = "run; begun; ";
    std::istringstream words(signals);
    std::string first, word;
    while (words >> word) {
      if (first.empty()) first = word;
      script += "kill -" + word + " $! 2> /dev/null; ";
    }
    const Outcome outcome =
        desk.shell(script + "wait $!; code=$?; exit $((code - $(kill -l " + first + ")))");
    CHECK(outcome.code == 128);
    CHECK(desk.good_checkpoint());
  }
}

// nohup, and whoever else starts a run that is to outlive its terminal.
TEST_CASE("a hang-up that was ignored before the run began stays ignored", "[cli][signals]") {
  for (const std::string rest : {"", "--dump=x.csv"}) {
    const Desk desk;
    const Outcome outcome = desk.shell("trap '' HUP; run " + rest +
                                       "; begun; kill -HUP $!; sleep 0.1; kill -TERM $!; wait $!");
    CHECK(outcome.code == 128 + SIGTERM);
    CHECK(desk.good_checkpoint());
  }
}

TEST_CASE("GNU timeout, which signals the process and its group, loses nothing", "[cli][signals]") {
  for (int k = 0; k < 15; ++k) {
    const Desk desk;
    const Outcome outcome =
        desk.shell("timeout 0.5 \"$SIM\" -T 1e9 --every 1000 --snap a.snap > log 2> err");
    CHECK(outcome.code == 124);
    CHECK(desk.good_checkpoint());
  }
}

TEST_CASE("limits of processor time and of files cost no checkpoint", "[cli][signals]") {
  const Desk desk;
  CHECK(desk.shell("ulimit -S -t 1; run; wait $!").code == 128 + SIGXCPU);
  CHECK(desk.good_checkpoint());
  const Desk small;
  CHECK(
      small.shell("ulimit -f 200; exec \"$SIM\" -n 2000 --dump=d.csv --snap a.snap 2> err").code ==
      5);
  CHECK(read_text(small.path("err")).find("File too large") != std::string::npos);
  CHECK(fs::exists(small.path("a.snap")));
  CHECK_FALSE(fs::exists(small.path("d.csv")));
}

TEST_CASE("the third signal ends a run at once, but not before its checkpoint", "[cli][signals]") {
  // It is blocked by a reader that does not read.
  const std::string blocked =
      "mkfifo f.csv; (sleep 3; exec cat > /dev/null) < f.csv & reader=$!\n"
      "\"$SIM\" -T 1e9 --dump=f.csv $SNAP > log 2> err & sleep 1\n"
      "kill -INT $!; sleep 0.1; kill -INT $!; sleep 1.2; kill -0 $! || exit 1\n"
      "kill -INT $!; sleep 0.3; kill -0 $! 2> /dev/null; echo alive $?\n"
      "wait $!; code=$?\n"
      "kill $reader 2> /dev/null; exit $code";
  const Desk without;
  const Outcome ended = without.shell(blocked);
  CHECK(ended.code == 130);
  CHECK(ended.out == "alive 1\n");
  const Desk with;
  const Outcome kept = with.shell("SNAP='--snap a.snap'\n" + blocked);
  CHECK(kept.code == 130);
  CHECK(kept.out == "alive 0\n");
  CHECK(with.good_checkpoint());
}
