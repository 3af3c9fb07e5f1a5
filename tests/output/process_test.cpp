// Programs that are fed through a pipe, and what they and their files leave behind.
#include <catch2/catch.hpp>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "core/output/process.h"
#include "tests/support/temporary.h"

namespace fs = std::filesystem;
using sim_test::TemporaryFolder;

namespace {

int open_files() {
  int count = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator("/proc/self/fd")) ++count;
  return count;
}

// Still running: there, and no zombie that nobody has waited for.
bool runs(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  const std::size_t name = text.rfind(')');
  return name != std::string::npos && text.size() > name + 2 && text[name + 2] != 'Z';
}

bool within_seconds(int seconds, const std::function<bool()>& done) {
  for (int i = 0; i < 100 * seconds && !done(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return done();
}

}  // namespace

TEST_CASE("a program that is let go ends with all that it has started") {
  const TemporaryFolder folder;
  int child = 0;
  {
    sim::Process process({sim::find_program("sh"), "-c", "sleep 300 & echo $! >child; wait"},
                         {.folder = folder.path().string()});
    REQUIRE(within_seconds(
        20, [&] { return std::ifstream(folder.path() / "child") >> child && child > 1; }));
    CHECK(runs(child));
    CHECK_FALSE(process.ended());
  }
  CHECK(within_seconds(20, [&] { return !runs(child); }));
}

TEST_CASE("programs and files that are done with leave no file open") {
  const TemporaryFolder folder;
  const std::string place = (folder.path() / "made.txt").string();
  const auto use_all = [&] {
    sim::Process process({sim::find_program("cat")});
    CHECK(process.write("words"));
    CHECK(process.finish() == "");
    sim::FileBeside kept(place), left(place);
    kept.commit();
  };
  use_all();
  const int before = open_files();
  for (int i = 0; i < 5; ++i) use_all();
  CHECK(open_files() == before);
  CHECK(fs::exists(place));
  CHECK(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()) == 1);
}

TEST_CASE("a program that fails says why in its own words") {
  sim::Process silent({sim::find_program("false")});
  CHECK(silent.finish() == "it failed");
  sim::Process loud({sim::find_program("sh"), "-c", "echo ---- >&2; echo no room >&2; exit 3"});
  CHECK(loud.finish() == "no room");
}
