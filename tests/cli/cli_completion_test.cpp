// Completion in a shell offers all that --help shows.
#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/support/skip.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

const std::vector<std::pair<std::string, std::string>> kPath = {
    {"PATH", std::string(SIM_LIB_DIR) + "/../bin:/usr/bin:/bin"}};

// The words that bash offers for the last of these.
std::string offered(const std::string& program, const std::string& words) {
  const TemporaryFolder folder;
  const std::string script = program == "sim" ? SIM_BINARY : SIM_REPL_BINARY;
  const Outcome outcome =
      run_sim({"-c", "source <(" + script + " --completion bash); COMP_WORDS=(" + words +
                         "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _" + program +
                         "; echo \"${COMPREPLY[*]}\""},
              {.program = "/bin/bash", .folder = folder.path(), .environment = kPath});
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  return outcome.out;
}

}  // namespace

TEST_CASE("bash completes verbs, options, scenes and integrators") {
  CHECK(offered("sim", "sim stab") == "stability\n");
  CHECK(offered("sim", "sim stability --ex") == "--extremes\n");
  CHECK(offered("sim", "sim -i ver") == "verlet\n");
  CHECK(offered("sim", "sim scenes/cloth_") == "scenes/cloth_ball.lua\n");
  CHECK(offered("sim", "sim stability stab") == "\n");  // one verb is enough
  CHECK(offered("simrepl", "simrepl --his") == "--history\n");
}

TEST_CASE("completions know every option and verb of the help") {
  for (const std::string shell : {"bash", "zsh", "fish"}) {
    const std::string script = run_sim({"--completion", shell}).out;
    for (const std::string& line : lines_of(run_sim({"--help"}).out))
      for (std::size_t at = line.find("--"); at != std::string::npos && line.starts_with("  -");
           at = std::string::npos) {
        const std::size_t end = line.find_first_of(" ,[=", at);
        const std::string name = line.substr(at + 2, end - at - 2);
        INFO(shell << ": " << name);
        CHECK(script.find(name) != std::string::npos);
      }
    CHECK(script.find("tradeoff") != std::string::npos);
  }
  CHECK(run_sim({"--completion", "csh"}).code == 2);
}

TEST_CASE("zsh and fish can read their completions") {
  // Fish makes a folder of its own where this says.
  const TemporaryFolder folder;
  auto environment = kPath;
  for (const char* name : {"HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME"})
    environment.emplace_back(name, folder.path().string());
  for (const std::string shell : {"zsh", "fish"}) {
    need_program(shell, shell);
    write_text(folder.path() / "script", run_sim({"--completion", shell}).out);
    const Outcome outcome = run_sim({"-n", (folder.path() / "script").string()},
                                    {.program = "/usr/bin/" + shell, .environment = environment});
    INFO(outcome.err);
    CHECK(outcome.code == 0);
  }
  const Outcome fish =
      run_sim({"-c", "source (" SIM_BINARY " --completion fish | psub); complete -C 'sim stab'"},
              {.program = "/usr/bin/fish", .environment = environment});
  CHECK(fish.out.starts_with("stability\t"));
}
