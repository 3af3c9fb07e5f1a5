// Skipped test cases are counted and named, by the test program and by `./dev test`.
#include "tests/support/skip.h"

#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;
using Catch::Contains;

namespace {

Outcome own_cases(const std::string& tag) {
  return run_sim({tag}, {.program = std::filesystem::read_symlink("/proc/self/exe").string()});
}

Outcome counted(const std::string& log) {
  const TemporaryFolder folder;
  write_text(folder.path() / "LastTest.log", log);
  return run_sim({(folder.path() / "LastTest.log").string()},
                 {.program = std::string(SIM_SOURCE_DIR) + "/tests/support/count_cases.sh"});
}

// The record of one test in the log of ctest.
std::string logged(const std::string& name, const std::string& output, const std::string& result) {
  return "3/9 Testing: " + name + "\n3/9 Test: " + name + "\nCommand: \"sim_tests\"\nOutput:\n" +
         "-----\n" + output + "<end of output>\nTest time =   0.02 sec\n-----\nTest " + result +
         ".\n\"" + name + "\" end time: now\n-----\n\n";
}

}  // namespace

TEST_CASE("a skipped case is named and neither passes nor fails") {
  const Outcome all = own_cases("[unicorns]");
  CHECK(all.code == 1);
  CHECK_THAT(all.out,
             Contains("skipped: a unicorn is fed: needs a unicorn (Debian: unicorn oats)\n"));
  CHECK_THAT(all.out, Contains("\ncases: 1 passed, 1 failed, 1 skipped\n"));
  CHECK_THAT(all.out, !Contains("went on") && !Contains("skipped: a cow"));
  const Outcome alone = own_cases("[unicorn]");
  CHECK(alone.code == 0);
  CHECK_THAT(alone.out, Contains("\ncases: 0 passed, 0 failed, 1 skipped\n"));
}

TEST_CASE("the closing lines of all tests count cases and say what to install") {
  const std::string some = logged("a/some", "cases: 4 passed, 0 failed, 0 skipped\n", "Passed");
  const Outcome all =
      counted(some +
              logged("a/skips",
                     "skipped: x: needs X (Debian: x y)\nskipped: z: needs (Z) (Debian: y)\n"
                     "cases: 3 passed, 0 failed, 2 skipped\n",
                     "Passed") +
              logged("a/fails", "cases: 1 passed, 2 failed, 0 skipped\n", "Failed") +
              logged("a/ends_badly", "cases: 5 passed, 0 failed, 0 skipped\n", "Failed") +
              logged("a/crashes", "signal\n", "Failed") + logged("b/script", "ok\n", "Passed") +
              logged("b/script_skips", "skipped: needs a build without sanitizers\n", "Passed"));
  CHECK(all.code == 0);
  CHECK(
      lines_of(all.out) ==
      std::vector<std::string>{"skipped: a/skips: x: needs X (Debian: x y)",
                               "skipped: a/skips: z: needs (Z) (Debian: y)",
                               "skipped: b/script_skips: needs a build without sanitizers",
                               "for what was skipped: apt-get install --no-install-recommends x y",
                               "14 passed, 4 failed, 3 skipped"});
  CHECK(counted(some).out == "4 passed, 0 failed, 0 skipped\n");
  CHECK(counted("").out == "0 passed, 0 failed, 0 skipped\n");
}
