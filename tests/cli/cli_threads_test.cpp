// A system that gives no further threads: a run goes on with those there are, and says so once.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

#ifdef SIM_SMALL_MACHINE

using namespace sim_test;

namespace {

constexpr const char* kWarning = "the system gives no more threads";

Outcome run_with(const std::string& threads, const std::vector<std::string>& arguments,
                 const TemporaryFolder& folder, const std::string& program = SIM_BINARY) {
  return run_sim(arguments,
                 {.program = program,
                  .input = ".step 3\n.hash\n",
                  .folder = folder.path(),
                  .environment = {{"LD_PRELOAD", SIM_SMALL_MACHINE}, {"FEW_THREADS", threads}}});
}

std::string hash_in(const std::string& json) { return json.substr(json.find("\"hash\":\""), 24); }

}  // namespace

TEST_CASE("a run with fewer threads than it wants has the same bits", "[cli]") {
  const TemporaryFolder folder;
  const std::vector<std::string> arguments{"-s", "n=96", "-n",     "60",
                                           "-j", "4",    "--json", "--verify"};
  const Outcome all = run_sim(arguments, {.folder = folder.path()});
  REQUIRE(all.code == 0);
  for (const char* threads : {"0", "1", "2"}) {
    const Outcome few = run_with(threads, arguments, folder);
    INFO(threads << "\n" << few.err);
    CHECK(few.code == 0);
    CHECK(hash_in(few.out) == hash_in(all.out));
    const std::size_t said = few.err.find(kWarning);
    CHECK(said != std::string::npos);
    CHECK(few.err.find(kWarning, said + 1) == std::string::npos);
  }
}

TEST_CASE("a prompt without threads works", "[cli]") {
  const TemporaryFolder folder;
  const Outcome session = run_with("0", {}, folder, SIM_REPL_BINARY);
  INFO(session.err);
  CHECK(session.code == 0);
  CHECK(session.err.find(kWarning) != std::string::npos);
}

TEST_CASE("films are drawn by as many threads as there are", "[cli]") {
  if (!std::filesystem::exists("/usr/bin/ffmpeg")) {
    WARN("skipped: no ffmpeg");
    return;
  }
  const TemporaryFolder folder;
  std::string first;
  // ffmpeg itself has the same limit, and fails with some.
  for (const char* threads : {"8", "1", "0"}) {
    const Outcome film = run_with(
        threads, {"-q", "-T", "0.3", "--size", "64x64", "--out", "f.gif", "--safe"}, folder);
    INFO(threads << "\n" << film.err);
    REQUIRE(film.code == 0);
    const std::string bytes = read_text(folder.path() / "f.gif");
    if (first.empty()) first = bytes;
    CHECK(bytes == first);
  }
}

#endif
