// Pages with the kernel in them, as far as no browser is needed: tests/web/page_test.py opens them.
#include <catch2/catch.hpp>
#include <fstream>

#include "tests/cli/program.h"
#include "tests/support/skip.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

using Catch::Contains;

const std::filesystem::path kKernel =
    std::filesystem::path(SIM_SOURCE_DIR) / "build" / "web" / "page.html";

// The part of the page between two texts.
std::string between(const std::string& page, const std::string& begin, const std::string& end) {
  const std::size_t from = page.find(begin) + begin.size();
  return page.substr(from, page.find(end, from) - from);
}

}  // namespace

TEST_CASE("a page is a file of HTML that holds a scene, not a run") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const auto refused = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"export", "scenes/cloth.lua", "--format", "page"});
    return run_sim(words, here);
  };
  CHECK(refused({"page.txt"}).code == 2);
  CHECK_THAT(refused({"page.txt"}).err, Contains("a page is .html"));
  CHECK_THAT(refused({"page.html", "-T", "1"}).err, Contains("the scene, not a run"));
  CHECK(!std::filesystem::exists(folder.path() / "page.html"));
  if (!std::filesystem::exists(kKernel)) {
    const Outcome missing = refused({"page.html"});
    CHECK(missing.code == 5);
    CHECK_THAT(missing.err, Contains("./dev web"));
  }
}

TEST_CASE("a page holds the scene and the modules beside it, as text that cannot leave its place") {
  if (!std::filesystem::exists(kKernel))
    skip("the module that ./dev web builds", "emscripten libc++-16-dev");
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  std::filesystem::create_directory(folder.path() / "parts");
  std::ofstream(folder.path() / "parts" / "step.lua") << "return 0.01 -- </script>@NONCE@";
  std::ofstream(folder.path() / "own.lua")
      << "-- </script><script>alert(1)</script> @KERNEL@\n"
         "local sim = require 'sim'\n"
         "return sim.scene { state = { x = { {1, 0, 0} } }, dt = require 'parts.step',\n"
         "  field = sim.field.rotation { omega = sim.arg('omega', 1, 'rad/s') },\n"
         "  integrator = 'rk4', duration = 1 }\n";
  const Outcome made = run_sim(
      {"export", "own.lua", "--format", "page", "page.html", "-s", "omega=2", "-i", "verlet2"},
      here);
  CHECK(made.code == 2);  // no such method: nothing is written
  CHECK(!std::filesystem::exists(folder.path() / "page.html"));
  const Outcome written = run_sim({"export", "own.lua", "--format", "page", "page.html", "-s",
                                   "omega=2", "-i", "midpoint", "-d", "0.02"},
                                  here);
  INFO(written.err);
  REQUIRE(written.code == 0);
  const std::string page = read_text(folder.path() / "page.html");
  const std::string scene = between(page, "const SCENE = ", ";\n");
  CHECK_THAT(scene, Contains("\"scene\":\"own.lua\"") && Contains("parts/step.lua"));
  CHECK_THAT(scene,
             Contains("set omega=2") && Contains("integrator midpoint") && Contains("dt 0.02"));
  CHECK(scene.find('<') == std::string::npos);
  CHECK_THAT(scene, Contains("@KERNEL@") && Contains("@NONCE@"));
  // One policy, with the nonce of the only scripts.
  const std::string nonce = between(page, "<script nonce=\"", "\"");
  CHECK(nonce.size() == 32);
  CHECK_THAT(between(page, "Content-Security-Policy\" content=\"", "\""),
             Contains("default-src") && Contains("nonce-" + nonce));
  CHECK(page.find("://") == std::string::npos);  // no address
  // The modules that come with sim are in the kernel.
  const Outcome cloth =
      run_sim({"export", "scenes/cloth.lua", "--format", "page", "cloth.html", "--json"}, here);
  CHECK_THAT(cloth.out, Contains("\"file\":\"cloth.html\"") && Contains("\"bytes\":"));
  const std::string shown = read_text(folder.path() / "cloth.html");
  const std::string files = between(shown, "const SCENE = ", ", NONCE");
  CHECK_THAT(files, Contains("scenes/cloth.lua") && !Contains("init.lua"));
}

}  // namespace sim_test
