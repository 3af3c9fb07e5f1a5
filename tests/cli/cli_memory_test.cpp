// Memory that runs out at any of a program's allocations: an error, a code, whole files.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

#ifdef SIM_FAILING_ALLOCATIONS

namespace {

ProgramOptions starved(const std::filesystem::path& folder, long at, bool for_ever) {
  ProgramOptions options;
  options.folder = folder;
  options.environment = {{"LD_PRELOAD", SIM_FAILING_ALLOCATIONS}, {"FAIL_COUNT", "count"}};
  if (at > 0) options.environment.emplace_back("FAIL_AT", std::to_string(at));
  if (for_ever) options.environment.emplace_back("FAIL_FOR_EVER", "1");
  return options;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("what a run needs is known before it is taken", "[cli][memory]") {
  // 2 GB of addresses: enough for verlet, not for the vectors and derivatives of an implicit
  // method.
  const auto run_within = [](const std::string& kilobytes, const std::string& words) {
    ProgramOptions shell{.program = "/bin/bash"};
    return run_sim({"-c", "ulimit -v " + kilobytes + "; exec " + std::string(SIM_BINARY) +
                              " -n 1 -q --no-verify " + words},
                   shell);
  };
  const auto within = [&](const std::string& words) {
    return run_within("2000000", "scenes/cloth.lua -s n=1200 " + words);
  };
  const Outcome small = within("-i verlet");
  INFO(small.err);
  CHECK(small.code == 0);
  const Outcome large = within("-i implicit_euler");
  CHECK(large.code == 5);
  CHECK(has(large.err, "sim: error: too little memory: "));
  CHECK(has(large.err, "'cloth' needs "));
  CHECK(has(large.err, "the method "));
  CHECK(has(large.err, " GB are left; "));

  const Outcome rope = run_within("400000", "scenes/rope.lua -s n=250000 -s length=25000");
  CHECK(rope.code == 5);
  CHECK(has(rope.err, "too little memory: "));
  CHECK(has(rope.err, "'rope' needs constraints "));
  // Pairs are counted before they are kept.
  const Outcome gas = run_within("300000", "scenes/gas.lua -s n=46");
  CHECK(gas.code == 5);
  CHECK(has(gas.err, "too little memory: the "));
}

TEST_CASE("memory that runs out ends a run with an error and whole files", "[cli][memory]") {
  const std::vector<std::string> arguments{
      "scenes/circle.lua", "-T", "0.02", "--quiet", "-d", "0.01", "--dump=d.csv"};
  const TemporaryFolder folder;
  REQUIRE(run_sim(arguments, starved(folder.path(), 0, false)).code == 0);
  const std::string whole = read_text(folder.path() / "d.csv");
  const long allocations = std::stol(read_text(folder.path() / "count"));
  REQUIRE(allocations > 1000);
  // The first allocations are those of constants before main(), where a failure ends the program.
  constexpr int kTried = 60, kMostBeforeMain = 80;
  long before_main = 0;
  for (int at = 1; at < kMostBeforeMain; ++at)
    if (has(run_sim(arguments, starved(folder.path(), at, false)).err, "terminate called"))
      before_main = at + 1;
  REQUIRE(before_main < kMostBeforeMain);
  int failed = 0;
  for (int k = 0; k < kTried; ++k) {
    const long at = before_main + (allocations - before_main) * k / kTried;
    for (const bool for_ever : {false, true}) {
      const TemporaryFolder place;
      const Outcome outcome = run_sim(arguments, starved(place.path(), at, for_ever));
      INFO("allocation " << at << (for_ever ? " and all after it: " : ": ") << outcome.err);
      // A loader without memory cannot open a library.
      CHECK((outcome.code == 0 || outcome.code == 5 || outcome.code == 7));
      if (outcome.code == 5)
        CHECK((has(outcome.err, "out of memory") || has(outcome.err, "Cannot allocate memory")));
      if (outcome.code == 7) CHECK(has(outcome.err, "cannot"));
      const bool written = std::filesystem::exists(place.path() / "d.csv");
      CHECK((written || outcome.code != 0));
      if (written) CHECK(read_text(place.path() / "d.csv") == whole);
      failed += outcome.code != 0;
    }
  }
  CHECK(failed > kTried);  // of 2 kTried: after the last one that matters a run may be whole
}

#else

TEST_CASE("memory that runs out ends a run with an error and whole files", "[cli][memory]") {
  SUCCEED("sanitizers have allocators of their own");
}

#endif
