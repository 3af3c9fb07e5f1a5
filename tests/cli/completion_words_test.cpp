// Completions of a small program: each kind of value, in each shell.
#include <catch2/catch.hpp>

#include "cli/command_line/command_spec.h"
#include "cli/command_line/shell_completion.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;
using Catch::Contains;
using sim::cli::CommandSpec;

namespace {

const CommandSpec kProgram{.name = "tool",
                           .doc = "a tool",
                           .options = {{{"-h", "--help"}, "", "shows this"},
                                       {{"-i", "--integrator"}, "NAME", "a method: [own] it's"},
                                       {{"--out"}, "FILE", "where to"},
                                       {{"--depth"}, "N", "how deep"}},
                           .verbs = {{.name = "dig",
                                      .doc = "digs",
                                      .options = {{{"-h", "--help"}, "", "shows this"},
                                                  {{"--into"}, "DIR", "a folder"},
                                                  {{"-f", "--from"}, "FILE.csv", "a table"},
                                                  {{"--integrators"}, "NAMES", "some"}},
                                      .verbs = {}},
                                     {.name = "fill",
                                      .doc = "fills it's hole",
                                      .options = {{{"--fast"}, "", "no waiting"}},
                                      .verbs = {}}}};

// The words that bash offers for the last of these, in their alphabet, in a folder of two files and
// a folder; a program of the name sim lists two methods and a scene.
std::string offered(const std::string& words) {
  const TemporaryFolder folder;
  write_text(folder.path() / "map.csv", "");
  std::filesystem::create_directory(folder.path() / "mine");
  write_text(folder.path() / "script", sim::cli::shell_completion(kProgram, "bash"));
  const Outcome outcome = run_sim(
      {"-c",
       "sim() { case $2 in integrators) echo verlet rk4 ;; scenes) echo meadow.lua ;; esac; }\n"
       "source ./script; COMP_WORDS=(" +
           words +
           "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _tool; printf '%s\\n' \"${COMPREPLY[@]}\" | "
           "LC_ALL=C sort | paste -sd ' '; complete -p tool >&2"},
      {.program = "/bin/bash", .folder = folder.path()});
  CHECK(outcome.code == 0);
  CHECK_THAT(outcome.err, Contains("-o filenames -F _tool tool"));
  return outcome.out;
}

}  // namespace

TEST_CASE("bash offers what may follow each word") {
  CHECK(offered("tool -") == "--depth --help --integrator --out -h -i\n");
  CHECK(offered("tool dig -") ==
        "--depth --from --help --help --integrator --integrators --into --out -f -h -h -i\n");
  CHECK(offered("tool fill --f") == "--fast\n");
  CHECK(offered("tool dig --fa") == "\n");
  CHECK(offered("tool ''") == "dig fill map.csv meadow.lua mine script\n");
  CHECK(offered("tool dig ''") == "map.csv meadow.lua mine script\n");
  CHECK(offered("tool m") == "map.csv meadow.lua mine\n");
  for (const char* name : {"-i", "--integrator", "--integrators"})
    CHECK(offered("tool dig " + std::string(name) + " ''") == "rk4 verlet\n");
  for (const char* name : {"--out", "-f", "--from"})
    CHECK(offered("tool dig " + std::string(name) + " m") == "map.csv mine\n");
  CHECK(offered("tool dig --into m") == "mine\n");
  CHECK(offered("tool --depth m") == "\n");
  CHECK(offered("tool --help m") == "map.csv meadow.lua mine\n");
}

TEST_CASE("zsh is told each option, its words and its values") {
  const std::string script = sim::cli::shell_completion(kProgram, "zsh");
  CHECK(script.starts_with("#compdef tool\n_tool() {\n"));
  CHECK(script.ends_with("  esac\n}\n_tool \"$@\"\n"));
  CHECK_THAT(script, Contains("  verbs=(\n    'dig:digs'\n    'fill:fills it'\\''s hole')\n"));
  CHECK_THAT(script, Contains("  scenes=($(sim list scenes --names 2>/dev/null))\n"));
  const std::string own =
      " \\\n      '*-i[a method: \\[own\\] it'\\''s]'\":integrator:($(sim list integrators --names "
      "2>/dev/null))\""
      " \\\n      '*--integrator[a method: \\[own\\] it'\\''s]'\":integrator:($(sim list "
      "integrators --names 2>/dev/null))\""
      " \\\n      '*--out[where to]'\":file:_files\""
      " \\\n      '*--depth[how deep]'\":value:\"";
  const std::string help =
      "_arguments -s \\\n      '*-h[shows this]' \\\n      '*--help[shows this]'";
  const std::string end = " \\\n      '*:word:_tool_words' ;;\n";
  std::string escaped = own;  // colons in words, too
  for (std::size_t at = escaped.find("method:"); at != std::string::npos;
       at = escaped.find("method:", at + 3))
    escaped.insert(at + 6, "\\");
  CHECK_THAT(script, Contains("    *) " + help + escaped + end));
  CHECK_THAT(script,
             Contains("    dig) " + help + escaped +
                      " \\\n      '*--into[a folder]'\":folder:_directories\""
                      " \\\n      '*-f[a table]'\":file:_files\""
                      " \\\n      '*--from[a table]'\":file:_files\""
                      " \\\n      '*--integrators[some]'\":integrator:($(sim list integrators "
                      "--names 2>/dev/null))\"" +
                      end));
  CHECK_THAT(script,
             Contains("    fill) " + help + escaped + " \\\n      '*--fast[no waiting]'" + end));
}

TEST_CASE("fish is told each option, its words and its values") {
  CHECK(sim::cli::shell_completion(kProgram, "fish") ==
        "# fish completion for tool\n"
        "complete -c tool -n __fish_use_subcommand -a dig -d 'digs'\n"
        "complete -c tool -n __fish_use_subcommand -a fill -d 'fills it'\\''s hole'\n"
        "complete -c tool -a '(sim list scenes --names 2>/dev/null)'\n"
        "complete -c tool -s h -l help -d 'shows this'\n"
        "complete -c tool -s i -l integrator -x -a '(sim list integrators --names 2>/dev/null)' -d "
        "'a method: [own] it'\\''s'\n"
        "complete -c tool -l out -r -F -d 'where to'\n"
        "complete -c tool -l depth -x -d 'how deep'\n"
        "complete -c tool -n '__fish_seen_subcommand_from dig' -l into -x -a "
        "'(__fish_complete_directories)' -d 'a folder'\n"
        "complete -c tool -n '__fish_seen_subcommand_from dig' -s f -l from -r -F -d 'a table'\n"
        "complete -c tool -n '__fish_seen_subcommand_from dig' -l integrators -x -a '(sim list "
        "integrators --names 2>/dev/null)' -d 'some'\n"
        "complete -c tool -n '__fish_seen_subcommand_from fill' -l fast -d 'no waiting'\n");
}

// A program without verbs, as the prompt is, offers none.
TEST_CASE("a program without verbs completes options and files") {
  CommandSpec program = kProgram;
  program.verbs.clear();
  const std::string bash = sim::cli::shell_completion(program, "bash");
  CHECK(bash.find("verb=$word") == std::string::npos);
  CHECK(bash.find("words+=") == std::string::npos);
  CHECK(sim::cli::shell_completion(program, "zsh").find("_describe") == std::string::npos);
  CHECK(sim::cli::shell_completion(program, "fish").find("subcommand") == std::string::npos);
  CHECK_THROWS_WITH(sim::cli::shell_completion(program, "csh"),
                    Contains("'csh'") && Contains("bash, zsh or fish"));
}
