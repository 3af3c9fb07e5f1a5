// The memory of a run does not grow with the frames that it writes, nor by its checkpoint.
#include <sys/resource.h>

#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

// The largest of all programs that were run, in MB: it can only grow.
double peak() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace

TEST_CASE("frames of a run are not kept in memory", "[cli][memory]") {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& file, const std::string& every) {
    const Outcome outcome =
        run_sim({"-q", "-s", "n=180", "-n", "60", "-d", "0.0001", "-j", "1", "--every", every,
                 "--size", "64x64", "--no-verify", "--out", file},
                {.folder = folder.path()});
    INFO(outcome.err);
    CHECK(outcome.code == 0);
  };
  std::vector<std::string> files{"a.npz", "a.pc2", "a.html", "a-%d.png"};
  if (std::filesystem::exists("/usr/bin/ffmpeg")) files.emplace_back("a.mp4");
  for (const std::string& file : files) run(file, "60");
  const double two_frames = peak();
  for (const std::string& file : files) {
    run(file, "1");
    INFO(file << ": " << two_frames << " MB with 2 frames, " << peak() << " MB with 61");
    CHECK(peak() < two_frames + 12);
  }
}

TEST_CASE("a checkpoint is written without a copy of the state", "[cli][memory]") {
  const TemporaryFolder folder;
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.end(), {"-q", "-s", "n=700", "-n", "1", "-j", "1", "--no-verify"});
    REQUIRE(run_sim(more, {.folder = folder.path()}).code == 0);
  };
  run({});
  const double without = peak();
  run({"--snap", "a.snap"});
  INFO(without << " MB without, " << peak() << " MB with a checkpoint");
  CHECK(peak() < without + 10);
}

TEST_CASE("the memory of a run's files is estimated before its first step", "[cli][memory]") {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& more) {
    return run_sim({"-c", std::string("ulimit -d 380000; exec '") + SIM_BINARY +
                              "' -s n=700 -n 1 -j 1 --no-verify " + more},
                   {.program = "/bin/sh", .folder = folder.path()});
  };
  CHECK(run("--snap a.snap").code == 0);
  const Outcome refused = run("--out a.npz --out b.npz");
  INFO(refused.err);
  CHECK(refused.code == 5);
  CHECK_THAT(refused.err, Catch::Contains("too little memory") &&
                              Catch::Contains("the files of 'cloth' need models of the scene"));
}
