// What help texts and README.md show can be typed, and gives what a reader expects.
#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

// As in a shell that finds the programs.
Outcome shell(const std::string& line, const std::filesystem::path& folder) {
  const std::string bin = std::filesystem::path(SIM_BINARY).parent_path().string();
  return run_sim(
      {"-c", line},
      {.program = "/bin/sh", .folder = folder, .environment = {{"PATH", bin + ":/usr/bin:/bin"}}});
}

// The command of "  sim ...      what it does".
std::string command_of(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(' ');
  return line.substr(begin, line.find("  ", begin) - begin);
}

bool is_run(const std::string& command) {
  for (const char* verb : {"tradeoff", "stability", "order", "list", "describe", "adjacency",
                           "help", "--debug", "echo", "simrepl", "observe", "minimal", "compare",
                           "sweep", "import", "export", "plot", "rest"})
    if (command.rfind(verb, 0) == 0 || command.rfind(std::string("sim ") + verb, 0) == 0)
      return false;
  return true;
}

void check(const std::vector<std::string>& lines, std::size_t least) {
  const TemporaryFolder folder;
  std::size_t checked = 0;
  for (const std::string& line : lines) {
    const std::string command = command_of(line);
    const Outcome outcome = shell(command, folder.path());
    INFO(command << '\n' << outcome.err);
    CHECK(outcome.code == 0);
    if (is_run(command))
      CHECK((outcome.err.find("trusted: ") != std::string::npos ||
             outcome.err.starts_with("chaotic: ")));
    ++checked;
  }
  CHECK(checked >= least);
}

std::string readme() { return read_text(std::string(SIM_SOURCE_DIR) + "/README.md"); }

// The lines between fences after the heading.
std::vector<std::string> block_under(const std::string& heading) {
  std::vector<std::string> block;
  bool found = false, inside = false;
  for (const std::string& line : lines_of(readme())) {
    found = found || line == heading;
    if (found && line.rfind("```", 0) == 0) {
      if (inside) break;
      inside = true;
    } else if (inside) {
      block.push_back(line);
    }
  }
  return block;
}

}  // namespace

TEST_CASE("the examples of both help texts run, and their runs are trusted") {
  std::vector<std::string> examples;
  for (const std::string& line : lines_of(run_sim({"--help"}).out))
    if (line.rfind("  sim ", 0) == 0) examples.push_back(line);
  check(examples, 3);
  examples.clear();
  for (const std::string& line : lines_of(run_sim({"--help"}, {.program = SIM_REPL_BINARY}).out))
    if (line.rfind("simrepl ", 0) == 0 || line.rfind("echo ", 0) == 0) examples.push_back(line);
  check(examples, 4);
}

TEST_CASE("the examples of README.md run, and their runs are trusted") {
  check(block_under("## Use"), 10);
  check(block_under("## Many runs"), 3);
}

TEST_CASE("the scenes that README.md prints run, and are trusted") {
  const TemporaryFolder folder;
  const std::string text = readme();
  int scenes = 0;
  for (std::size_t at = text.find("```lua\n"); at != std::string::npos;
       at = text.find("```lua\n", at + 1)) {
    const std::string code = text.substr(at + 7, text.find("\n```", at) - at - 6);
    if (code.find("return sim.scene") == std::string::npos) continue;
    write_text(folder.path() / "scene.lua", code);
    const Outcome outcome = run_sim({"scene.lua"}, {.folder = folder.path()});
    INFO(code << '\n' << outcome.err);
    CHECK(outcome.err.rfind("trusted: ", 0) == 0);
    ++scenes;
  }
  CHECK(scenes >= 2);
}

TEST_CASE("sim help is sim --help, also of a verb") {
  CHECK(run_sim({"help"}).out == run_sim({"--help"}).out);
  CHECK(run_sim({"help", "order"}).out == run_sim({"order", "--help"}).out);
  CHECK(run_sim({"help", "order"}).out.find("convergence") != std::string::npos);
}
