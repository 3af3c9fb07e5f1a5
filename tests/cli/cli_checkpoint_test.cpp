// sim --snap and --resume: one run in two parts is the run in one part.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

std::vector<std::string> joined(std::vector<std::string> list, std::vector<std::string> more) {
  list.insert(list.end(), more.begin(), more.end());
  return list;
}

}  // namespace

TEST_CASE("a run in two parts has the rows of the run in one") {
  TemporaryFolder folder;
  const std::string snap = (folder.path() / "a.snap").string();
  for (const std::vector<std::string>& run :
       std::vector<std::vector<std::string>>{{"scenes/cloth.lua", "verlet", "0.002", "-s", "n=5"},
                                             {"scenes/pendulum.lua"},
                                             {"scenes/circle.lua"},
                                             {"scenes/cloth.lua", "-i", "dopri5", "--tol", "1e-7"},
                                             {"scenes/cloth.lua", "-i", "rk4:precision=single"},
                                             {"scenes/sample.lua"}}) {
    const std::string scene = run.front();
    INFO(scene);
    REQUIRE(run_sim(joined(run, {"-n", "60", "-q", "--snap", snap})).code == 0);
    const auto rest = [&](const std::string& table) {
      return lines_of(run_sim({scene, "--resume", snap, "-n", "100", "-q", table}).out);
    };
    const auto whole = [&](const std::string& table) {
      return lines_of(run_sim(joined(run, {"-n", "100", "-q", table})).out);
    };
    for (const std::string table : {"--dump", "--energy"}) {
      if (scene == "scenes/circle.lua" && table == "--energy") continue;
      auto part = rest(table), all = whole(table);
      REQUIRE(part.size() > 40);
      REQUIRE(part.size() < all.size());
      CHECK(part.front() == all.front());
      CHECK(part.back() == all.back());
      std::sort(part.begin(), part.end());  // the systems of a world begin together again
      std::sort(all.begin(), all.end());
      CHECK(std::includes(all.begin(), all.end(), part.begin(), part.end()));
    }
  }
}

TEST_CASE("a checkpoint keeps what the run was made with, and refuses anything else") {
  TemporaryFolder folder;
  const std::string snap = (folder.path() / "a.snap").string();
  REQUIRE(
      run_sim({"scenes/cloth.lua", "euler", "1e-5", "-s", "n=6", "-n", "20", "-q", "--snap", snap})
          .code == 0);
  const std::string bytes = read_text(snap);
  CHECK(run_sim({"--resume", snap, "-n", "30", "-q"}).code == 0);
  CHECK(run_sim({"--resume", snap, "-n", "30", "-q", "-i", "e", "-d", "1e-5", "-s", "n=6"}).code ==
        0);
  for (const std::vector<std::string>& other :
       std::vector<std::vector<std::string>>{{"-i", "rk4"},
                                             {"--precision", "single"},
                                             {"-d", "2e-5"},
                                             {"-s", "n=7"},
                                             {"-s", "shear=51"}}) {
    INFO(other[1]);
    const Outcome outcome = run_sim(joined({"--resume", snap, "-n", "30"}, other));
    CHECK(outcome.code == 6);
    CHECK(outcome.err.starts_with("sim: error: cannot resume: " + snap));
  }
  CHECK(run_sim({"scenes/pendulum.lua", "--resume", snap}).code == 6);
  CHECK(run_sim({"scenes/sample.lua", "--resume", snap}).code == 6);
  CHECK(run_sim({"--resume", snap, "-n", "10"}).code == 2);  // it is beyond that
  CHECK(run_sim({"--resume", (folder.path() / "none").string()}).code == 5);
  CHECK(run_sim({"--resume", folder.path().string()}).code == 5);
  CHECK(run_sim({"-n", "1", "--snap", "/nowhere/a"}).code == 5);
  CHECK(run_sim({"-n", "1", "--snap", snap, "--dump=" + snap}).code == 2);
  write_text(folder.path() / "a.csv", "step,t\n");
  CHECK(run_sim({"--resume", (folder.path() / "a.csv").string()}).code == 6);

  // A run that ends badly replaces nothing.
  CHECK(run_sim({"nowhere.lua", "--snap", snap}).code == 5);
  CHECK(read_text(snap) == bytes);
  CHECK(files_in(folder.path()) == 2);
}

TEST_CASE("an interrupted run can be gone on with") {
  TemporaryFolder folder;
  const std::string snap = (folder.path() / "a.snap").string();
  const Outcome outcome = run_sim({"-T", "1000", "--every", "1000", "--snap", snap},
                                  {.signal = SIGINT, .signal_at = "drift [J]"});
  CHECK(outcome.code == 130);
  CHECK(run_sim({"--resume", snap, "-T", "1000", "-q"}).code == 0);
}

TEST_CASE("a file without an end is no checkpoint") {
  const Outcome outcome = run_sim({"--resume", "/dev/zero"});
  CHECK(outcome.code == 6);
  CHECK(outcome.err.find("it is not a checkpoint file") != std::string::npos);
}
