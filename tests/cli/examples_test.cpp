// Commands of help texts, README.md and docs/ can be typed, and give what a reader expects.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <regex>
#include <set>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

// Runs a line in a shell that finds the programs.
Outcome shell(const std::string& line, const std::filesystem::path& folder) {
  const std::string bin = std::filesystem::path(SIM_BINARY).parent_path().string();
  return run_sim({"-c", line}, {.program = "/bin/sh",
                                .folder = folder,
                                .environment = {{"PATH", bin + ":/usr/bin:/bin"},
                                                {"OMPI_ALLOW_RUN_AS_ROOT", "1"},
                                                {"OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"}}});
}

// The command of "  sim ...      what it does".
std::string command_of(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(' ');
  return line.substr(begin, line.find("  ", begin) - begin);
}

bool is_run(const std::string& command) {
  if (command.find("--version") != std::string::npos) return false;
  if (command.find("--debug-particle") != std::string::npos) return false;
  for (const char* verb : {"tradeoff", "stability", "order",  "list",    "describe", "adjacency",
                           "help",     "--debug",   "echo",   "simrepl", "observe",  "minimal",
                           "compare",  "sweep",     "import", "export",  "plot",     "rest",
                           "doctor",   "view",      "plugin", "explain", "scene new"})
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

// README.md and every page of docs/.
std::vector<std::filesystem::path> pages() {
  const std::filesystem::path root = SIM_SOURCE_DIR;
  std::vector<std::filesystem::path> found{root / "README.md"};
  for (const auto& entry : std::filesystem::directory_iterator(root / "docs"))
    if (entry.path().extension() == ".md") found.push_back(entry.path());
  std::ranges::sort(found);
  return found;
}

// The blocks between fences of one language.
std::vector<std::string> blocks_of(const std::filesystem::path& page, const std::string& language) {
  std::vector<std::string> blocks;
  bool inside = false, wanted = false;
  for (const std::string& line : lines_of(read_text(page))) {
    if (line.starts_with("```")) {
      inside = !inside;
      wanted = inside && line == "```" + language;
      if (wanted) blocks.emplace_back();
    } else if (wanted) {
      blocks.back() += line + "\n";
    }
  }
  return blocks;
}

bool in_path(const std::string& program) {
  for (const char* folder : {"/usr/bin/", "/bin/", "/usr/local/bin/"})
    if (std::filesystem::exists(folder + program)) return true;
  return false;
}

// True for a program of another package that is not here.
bool lacks_program(const std::string& command) {
  const auto has = [&](const char* part) { return command.find(part) != std::string::npos; };
  const std::string parts = run_sim({"doctor"}).out;
  const auto absent = [&](const std::string& part) {
    return parts.find("absent " + part) != std::string::npos;
  };
  return ((has(".mp4") || has(".webm")) && !in_path("ffmpeg")) ||
         (has("--engine lammps") && !in_path("lmp")) || (has("--ranks") && !in_path("mpirun")) ||
         (has("--engine petsc") && absent("petsc")) || (has(".h5") && absent("HDF5")) ||
         (has("sim view") && absent("page"));
}

// Runs a line of a page. Its comment says if the run is suspect or diverges.
void check_line(const std::string& line, const std::filesystem::path& folder) {
  std::string command = command_of(line);
  if (lacks_program(command)) return;
  const std::string comment =
      line.substr(std::min(line.size(), line.find(command) + command.size()));
  const bool live = command.starts_with("sim view");
  if (live) command = "timeout -s INT 2 " + command;
  const Outcome outcome = shell(command, folder);
  INFO(command << '\n' << outcome.err);
  const auto said = [&](const char* word) { return outcome.err.find(word) != std::string::npos; };
  if (comment.find("diverges") != std::string::npos) {
    CHECK(outcome.code == 4);
    CHECK(said("diverged: "));
    return;
  }
  CHECK((outcome.code == 0 || (live && (outcome.code == 124 || outcome.code == 130))));
  if (comment.find("suspect") != std::string::npos)
    CHECK(said("suspect: "));
  else if (is_run(command) && command.find("--json") == std::string::npos && !live)
    CHECK((said("trusted: ") || said("unverified: ") || said("chaotic: ")));
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

TEST_CASE("the commands of README.md and docs/ run, and say what the pages say") {
  std::size_t checked = 0;
  for (const std::filesystem::path& page : pages()) {
    const TemporaryFolder folder;
    INFO(page);
    for (const std::string& block : blocks_of(page, "sh"))
      for (const std::string& line : lines_of(block)) {
        if (line.empty()) continue;
        check_line(line, folder.path());
        ++checked;
      }
  }
  CHECK(checked >= 80);
}

TEST_CASE("the scenes that the pages print run, and are trusted") {
  const TemporaryFolder folder;
  int scenes = 0;
  for (const std::filesystem::path& page : pages())
    for (const std::string& code : blocks_of(page, "lua")) {
      if (code.find("return sim.scene") == std::string::npos) continue;
      write_text(folder.path() / "scene.lua", code);
      const Outcome outcome = run_sim({"scene.lua"}, {.folder = folder.path()});
      INFO(page << '\n' << code << '\n' << outcome.err);
      CHECK(outcome.err.starts_with("trusted: "));
      ++scenes;
    }
  CHECK(scenes >= 8);
}

// A page that is linked to, a picture that is shown.
TEST_CASE("links of the pages lead somewhere") {
  const std::set<std::string> made = {"reference.md", "command-line.md"};  // by ./dev docs
  const std::regex link(R"(\]\(([^)#:]+)(#[^)]*)?\))");
  std::size_t checked = 0;
  for (const std::filesystem::path& page : pages()) {
    const std::string text = read_text(page);
    for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at) {
      INFO(page << ": " << at->str(1));
      const std::string name = at->str(1);
      CHECK((made.contains(name) || std::filesystem::exists(page.parent_path() / name)));
      ++checked;
    }
  }
  CHECK(checked >= 50);
}

TEST_CASE("README.md is short, and every verb of ./dev that the pages name is one") {
  CHECK(lines_of(read_text(std::string(SIM_SOURCE_DIR) + "/README.md")).size() <= 250);
  const std::string known = run_sim({"help"}, {.program = SIM_SOURCE_DIR "/dev"}).out;
  const std::regex verb(R"(\./dev ([a-z]+))");
  for (const std::filesystem::path& page : pages()) {
    const std::string text = read_text(page);
    for (std::sregex_iterator at(text.begin(), text.end(), verb), end; at != end; ++at) {
      INFO(page << ": " << at->str());
      if (at->str(1) == "help") continue;
      CHECK(known.find("\n  " + at->str(1)) != std::string::npos);
    }
  }
}

TEST_CASE("sim help is sim --help, also of a verb") {
  CHECK(run_sim({"help"}).out == run_sim({"--help"}).out);
  CHECK(run_sim({"help", "order"}).out == run_sim({"order", "--help"}).out);
  CHECK(run_sim({"help", "order"}).out.find("convergence") != std::string::npos);
}
