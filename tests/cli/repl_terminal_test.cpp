// Sessions at a terminal: editing, completion, history, Ctrl-C, paste; and the one in
// docs/prompt.md.
#include <catch2/catch.hpp>
#include <fstream>
#include <regex>

#include "tests/cli/terminal.h"
#include "tests/support/skip.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

std::string command_in(const TemporaryFolder& folder) {
  return "XDG_STATE_HOME=" + folder.path().string() + " EDITRC=/dev/null " + SIM_REPL_BINARY +
         "; echo exit $?; sleep 100";
}

// Waits until the text stands at two places of the screen.
bool shows_twice(Tmux& tmux, const std::string& text) {
  for (int look = 0; look < 600; ++look) {
    const std::string screen = tmux.screen();
    const std::size_t first = screen.find(text);
    if (first != std::string::npos && screen.find(text, first + 1) != std::string::npos)
      return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

// The lines of the page between "```" fences that begin with this one.
std::vector<std::string> block_of_page(const std::string& first) {
  std::vector<std::string> block;
  bool inside = false;
  for (const std::string& line :
       lines_of(read_text(std::string(SIM_SOURCE_DIR) + "/docs/prompt.md"))) {
    if (inside && line == "```") return block;
    inside = inside || line == first;
    if (inside) block.push_back(line);
  }
  return {};
}

}  // namespace

TEST_CASE("repl: the session in the documents is what happens") {
  const std::vector<std::string> block = block_of_page("$ ./dev repl");
  REQUIRE(block.size() > 10);
  const std::regex prompt("(\\S+ [0-9.e+-]+ s> |\\.\\.\\. )(.*)");
  TemporaryFolder folder;
  PlainTerminal terminal(SIM_REPL_BINARY, {}, folder.path().string());
  std::string expected, said;
  for (std::size_t i = 1; i < block.size(); ++i) {
    std::smatch match;
    if (std::regex_match(block[i], match, prompt)) {
      said += terminal.wait_for(match[1].str());
      terminal.type(match[2].str() + "\r");
    }
    expected += block[i] + "\n";
  }
  said += terminal.wait_for("s> ");
  // The banner names the file where it is.
  said.erase(0, said.find("\ncloth ") + 1);
  said.erase(said.rfind('\n') + 1);
  CHECK(said == expected);
}

TEST_CASE("repl: what a scene has to say is told when it is loaded") {
  TemporaryFolder folder;
  const std::string file = folder.path().string() + "/ball.lua";
  std::ofstream(file) << R"(local sim = require "sim"
local p = sim.particles { mass = 1 }
for i = 0, 2 do for j = 0, 2 do for k = 0, 2 do p:add { 0.1 * i, 0.1 * j, 0.1 * k } end end end
local ball = sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 1, position = {0, 2, 0} }
return sim.scene { particles = p, bodies = { ball }, forces = { sim.force.fluid {} },
  integrator = "verlet", dt = 0.0001, duration = 1 })";
  PlainTerminal terminal(SIM_REPL_BINARY, {file}, folder.path().string());
  const std::string said = terminal.wait_for("ball 0 s> ");
  CHECK(said.find("ball.lua:5 does not see body 0") != std::string::npos);
}

TEST_CASE("repl: a terminal that cannot do anything still works") {
  TemporaryFolder folder;
  PlainTerminal terminal(SIM_REPL_BINARY, {"scenes/circle.lua"}, folder.path().string());
  CHECK(terminal.wait_for("circle 0 s> ").starts_with("sim "));
  terminal.type("1 + 1\r");
  CHECK(terminal.wait_for("circle 0 s> ") == "1 + 1\n2\ncircle 0 s> ");
  terminal.type("error(\"x\")\r");
  CHECK(terminal.wait_for("s> ").find("sim: error: Lua error: prompt:1: x\n") != std::string::npos);
  terminal.type(".step\r");
  CHECK(terminal.wait_for("s> ").find("step 1  t = 0.01 s  trapezoid, dt = 0.01 s\n") !=
        std::string::npos);
  terminal.type("\x03");
  CHECK(terminal.wait_for("s> ").find("^C") != std::string::npos);
  terminal.type("\x04");
  terminal.wait_for("\nnever");
}

TEST_CASE("repl: after steps each system of a world has a line of its own, the first too") {
  TemporaryFolder folder;
  PlainTerminal terminal(SIM_REPL_BINARY, {"scenes/sample.lua"}, folder.path().string());
  terminal.wait_for(" s> ");
  terminal.type(".step 3\r");
  const std::vector<std::string> lines = lines_of(terminal.wait_for(" s> "));
  REQUIRE(lines.size() == 5);  // as typed, three systems, the prompt
  CHECK(lines[1] == "circle  step 3  t = 0.03 s  trapezoid, dt = 0.01 s");
  CHECK(lines[2].starts_with("cloth  step 3  t = 0.015 s  energy "));
  CHECK(lines[3].starts_with("pendulum  step 3  t = 0.015 s  energy "));
}

TEST_CASE("repl: lines that go on, completion, paste") {
  need_program("tmux", "tmux");
  TemporaryFolder folder;
  Tmux tmux(command_in(folder), folder.path() / "tmux");
  REQUIRE(tmux.shows("cloth 0 s>"));
  tmux.enter("for i = 41, 42 do");
  REQUIRE(tmux.shows("\n..."));
  tmux.enter("print(i .. \"!\")");
  tmux.enter("end");
  CHECK(tmux.shows("\n41!\n42!\n"));

  // A function of Lua, a command, an integrator, a file; and what there is to choose from.
  tmux.type("sim.posi");
  tmux.key("Tab");
  CHECK(tmux.shows("> sim.position("));
  tmux.enter("12)");
  CHECK(tmux.shows("{0.5, 0.0, 0.125}"));
  tmux.type(".integ");
  tmux.key("Tab");
  tmux.type("verl");
  tmux.key("Tab");
  CHECK(tmux.shows("> .integrator verlet"));
  tmux.key("Enter");
  CHECK(tmux.shows("verlet, dt = 0.005 s"));
  write_text(folder.path() / "a_long_name.csv", "");
  tmux.type(".dump " + folder.path().string() + "/a_lo");
  tmux.key("Tab");
  CHECK(tmux.shows("/a_long_name.csv"));
  tmux.key("C-c");
  CHECK(tmux.shows("^C"));
  tmux.type("mode = {alpha = 1, beta = 2}");
  tmux.key("Enter");
  tmux.type("mode.");
  tmux.key("Tab");
  CHECK(tmux.shows("mode.alpha  mode.beta"));
  tmux.key("C-c");
  CHECK(tmux.shows("mode.^C"));
  tmux.type("sim.force.");
  tmux.key("Tab");
  CHECK(tmux.shows("sim.force.gravity  "));
  tmux.key("C-c");
  CHECK(tmux.shows("sim.force.^C"));  // what is typed before it would be dropped with the line

  tmux.paste("pasted = {\n  123,\n}\npasted\n.step 3\n");
  CHECK(tmux.shows("pasted = {\n  123,\n}"));
  CHECK_FALSE(tmux.screen().find("{123}") != std::string::npos);  // nothing runs before Enter
  tmux.key("Enter");
  CHECK(tmux.shows("\n{123}\nstep 3  t = 0.015 s"));
  tmux.key("C-d");
  CHECK(tmux.shows("exit 0"));
}

TEST_CASE("repl: history from one session to the next") {
  need_program("tmux", "tmux");
  TemporaryFolder folder;
  {
    Tmux tmux(command_in(folder), folder.path() / "tmux");
    REQUIRE(tmux.shows("cloth 0 s>"));
    tmux.enter("remembered = {");
    tmux.enter("77 }");
    tmux.enter("\"second entry\"");
    REQUIRE(tmux.shows("\n\"second entry\""));
  }  // killed: what was typed is kept all the same
  Tmux tmux(command_in(folder), folder.path() / "another");
  REQUIRE(tmux.shows("cloth 0 s>"));
  tmux.key("Up");
  CHECK(tmux.shows("> \"second entry\""));
  tmux.key("Up");
  CHECK(tmux.shows("> remembered = {\n77 }"));
  tmux.key("Enter");
  tmux.enter("remembered");
  CHECK(tmux.shows("\n{77}\n"));
  tmux.key("C-r");
  tmux.type("second");
  CHECK(tmux.shows("> \"second entry\""));
  tmux.key("Enter");
  CHECK(tmux.shows("\n\"second entry\"\n"));
}

// Earlier versions wrote the time of each entry before its lines.
TEST_CASE("repl: histories of earlier sessions are read and kept") {
  need_program("tmux", "tmux");
  TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "sim");
  const std::filesystem::path file = folder.path() / "sim" / "history";
  write_text(file, "#1700000000\nolder = 1\n#1700000001\nboth = {\n5 }\n");
  {
    Tmux tmux(command_in(folder), folder.path() / "tmux");
    REQUIRE(tmux.shows("cloth 0 s>"));
    tmux.key("Up");
    CHECK(tmux.shows("> both = {\n5 }"));
    tmux.key("Up");
    CHECK(tmux.shows("> older = 1"));
    tmux.key("C-c");
    CHECK(tmux.shows("> older = 1^C"));
    tmux.enter("newer = {");
    tmux.enter("6 }");
    tmux.enter("\"written\"");
    REQUIRE(tmux.shows("\n\"written\""));
  }
  const std::string text = read_text(file);
  CHECK(text.starts_with("#1700000000\nolder = 1\n#1700000001\nboth = {\n5 }\n#"));
  CHECK(text.find("\nnewer = {\n6 }\n#") != std::string::npos);
  CHECK(text.ends_with("\n\"written\"\n"));
}

TEST_CASE("repl: keys of editing, and characters of several bytes") {
  need_program("tmux", "tmux");
  TemporaryFolder folder;
  Tmux tmux(command_in(folder), folder.path() / "tmux");
  REQUIRE(tmux.shows("cloth 0 s>"));
  tmux.type("\"\xc3\xa9x\xe2\x82\xac\"");
  tmux.key("Left");
  tmux.key("Left");
  tmux.key("BSpace");
  tmux.key("Enter");
  CHECK(tmux.shows("\n\"\xc3\xa9\xe2\x82\xac\"\n"));
  tmux.type("one two");
  tmux.key("C-w");
  tmux.key("Home");
  tmux.type("\"");
  tmux.key("End");
  tmux.type("three\"");
  tmux.key("Enter");
  CHECK(tmux.shows("\n\"one three\"\n"));
}

TEST_CASE("repl: Ctrl-C clears a line and stops a run or a loop, never the session") {
  need_program("tmux", "tmux");
  TemporaryFolder folder;
  Tmux tmux(command_in(folder), folder.path() / "tmux");
  REQUIRE(tmux.shows("cloth 0 s>"));
  tmux.type("half a li");
  REQUIRE(tmux.shows("half a li"));  // else Ctrl-C overtakes it
  tmux.key("C-c");
  REQUIRE(tmux.shows("half a li^C"));
  tmux.enter("x = {");
  REQUIRE(tmux.shows("\n..."));
  tmux.key("C-c");
  REQUIRE(shows_twice(tmux, "^C"));
  tmux.enter("\"alive 1\"");
  CHECK(tmux.shows("\n\"alive 1\""));

  tmux.enter(".step 1000000000");
  CHECK(tmux.shows(" steps/s   "));
  CHECK(tmux.screen().find(" x real time   drift ") != std::string::npos);
  tmux.key("C-c");
  CHECK(tmux.shows("\nstopped\nstep "));
  CHECK(tmux.screen().find("steps/s") == std::string::npos);  // the line of progress is gone
  tmux.enter("s = taken() return s > 100 and s < 1e9 and t() == s * 0.005");
  CHECK(tmux.shows("\ntrue\n"));

  tmux.enter("while true do pcall(step, 10) end");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  tmux.key("C-c");
  tmux.enter("\"alive 2\"");
  CHECK(tmux.shows("\n\"alive 2\""));
  tmux.enter("while true do pcall(function() while true do end end) end");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  tmux.key("C-c");
  tmux.enter("\"alive 3\"");
  CHECK(tmux.shows("\n\"alive 3\""));
  tmux.enter(".until false");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  tmux.key("C-c");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  tmux.enter("quit");
  CHECK(tmux.shows("exit 0"));
}
