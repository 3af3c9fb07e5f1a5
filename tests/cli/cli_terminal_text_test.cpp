// Text of a stranger's scene, file or path reaches a terminal as characters.
#include <catch2/catch.hpp>

#include <algorithm>

#include "core/base/utf8.h"
#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

const std::string kEnd =
    "return sim.scene { particles = p, forces = f, integrator = 'rk4', dt = 0.01, duration = 0.1 "
    "}\n";

std::string scene_of(const TemporaryFolder& folder, const std::string& text,
                     const std::string& name = "scene.lua") {
  const std::string file = (folder.path() / name).string();
  write_text(file,
             "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 }\n"
             "p:add {0, 0, 0}\nlocal f = {}\n" +
                 text + kEnd);
  return file;
}

// Nothing but characters on both streams.
Outcome shown(const std::vector<std::string>& arguments) {
  const Outcome outcome = run_sim(arguments);
  CHECK(sim::is_visible(outcome.out));
  CHECK(sim::is_visible(outcome.err));
  return outcome;
}

}  // namespace

TEST_CASE("documentation and defaults of a scene are shown as text", "[cli][terminal]") {
  const TemporaryFolder folder;
  const std::string file = scene_of(
      folder, "sim.arg('a', 'x\\27]0;title\\7\\xff\\u{9b}31m', 'doc\\27[2J \\u{202e}gnp.exe')\n");
  const Outcome words = shown({"describe", file});
  CHECK(words.code == 0);
  CHECK_THAT(words.out, Catch::Contains("x\\x1b]0;title\\x07\\xff\\u009b31m") &&
                            Catch::Contains("doc\\x1b[2J \\u202egnp.exe"));
  const Outcome json = shown({"describe", file, "--json"});
  CHECK_THAT(json.out, Catch::Contains("x\\u001b]0;title\\u0007\\ufffd\\u009b31m"));
}

TEST_CASE("names with control characters are refused where they are written", "[cli][terminal]") {
  const TemporaryFolder folder;
  for (const std::string name : {"a\\27[31m", "a\\u{202e}b", "a\\xff", "a\\u{85}", "a\\nb"}) {
    const Outcome outcome = shown(
        {scene_of(folder, "p:add {1, 0, 0}\nf[1] = sim.force.spring { stiffness = 1, family = \"" +
                              name + "\", ties = { {0, 1} } }\n")});
    CHECK(outcome.code == 3);
    CHECK_THAT(outcome.err, Catch::Contains("scene.lua:6") && Catch::Contains("family") &&
                                Catch::Contains("plain text"));
  }
  CHECK(shown({scene_of(folder,
                        "p:add {1, 0, 0}\nf[1] = sim.force.spring { stiffness = 1, family "
                        "= 'Gewebe \xc3\xa4', ties = { {0, 1} } }\n")})
            .code == 0);
}

TEST_CASE("errors and paths are shown as text", "[cli][terminal]") {
  const TemporaryFolder folder;
  CHECK_THAT(shown({"\x1b]0;x\x07.lua"}).err, Catch::Contains("\\x1b]0;x\\x07.lua"));
  CHECK_THAT(shown({"scenes/\xe2\x80\xae.lua"}).err, Catch::Contains("\\u202e"));
  CHECK_THAT(shown({scene_of(folder, "error('\\27c\\u{2066}')\n")}).err,
             Catch::Contains("\\x1bc\\u2066"));
}

TEST_CASE("an error never cuts a character", "[cli][terminal]") {
  const TemporaryFolder folder;
  for (std::size_t size = 36; size < 42; ++size) {
    const Outcome outcome = shown({scene_of(
        folder, "p:pin('" + std::string(size, 'x') + "\xe2\x82\xac\xe2\x82\xac\xe2\x82\xac')\n")});
    CHECK(outcome.code == 3);
    CHECK(outcome.err.find("\\x") == std::string::npos);
  }
}

TEST_CASE("what a scene prints is shown as text", "[cli][terminal]") {
  const TemporaryFolder folder;
  const std::string file = scene_of(folder, "print('a\\27[31m\\tb')\n", "\x1b[1m.lua");
  const Outcome printed = shown({file});
  CHECK(printed.code == 0);
  CHECK_THAT(printed.err, Catch::Contains("a\\x1b[31m\tb\n"));
  CHECK_THAT(printed.out, Catch::Contains("\\x1b[1m.lua"));
}

TEST_CASE("print ends at a size, and a line says what was left out", "[cli][terminal]") {
  const TemporaryFolder folder;
  const auto printing = [&](const std::string& lines) {
    return scene_of(folder, "for i = 1, " + lines + " do print(('x'):rep(999)) end\n");
  };
  const Outcome safe = run_sim({printing("2500"), "--safe"});
  CHECK(safe.code == 0);
  CHECK(std::ranges::count(safe.err, 'x') >= 999'000);
  CHECK(safe.err.size() < 1'002'000);
  CHECK_THAT(safe.err,
             Catch::Contains("print: 1500000 bytes in 1500 lines were left out, beyond 1 MB\n"));
  const Outcome trusted = run_sim({printing("70000")});
  CHECK(trusted.code == 0);
  CHECK(trusted.err.size() < 64'002'000);
  CHECK_THAT(trusted.err.substr(trusted.err.size() - 2000),
             Catch::Contains("print: 6000000 bytes in 6000 lines were left out, beyond 64 MB\n"));
  ProgramOptions repl{.program = SIM_REPL_BINARY};
  const Outcome prompt = run_sim(
      {"--safe", "-e", "for i = 1, 2500 do print(('x'):rep(999)) end", "-e", "print('next')"},
      repl);
  CHECK_THAT(prompt.out, Catch::Contains("1500 lines were left out") && Catch::EndsWith("next\n"));
}
