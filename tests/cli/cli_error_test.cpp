// sim SCENE --error E and `error =` of a scene: what does not go with it, exit codes, the prompt.
#include <catch2/catch.hpp>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string pendulum(const TemporaryFolder& folder, const std::string& error) {
  const std::string file = (folder.path() / "swing.lua").string();
  write_text(
      file,
      "local sim = require 'sim'\n"
      "local p = sim.particles { mass = 1 }\n"
      "p:add({0, 0, 0}) p:add({1, 0, 0}) p:pin(0)\n"
      "return sim.scene { particles = p, forces = { sim.force.gravity { g = {0, -9.81, 0} },\n"
      "  sim.force.spring { stiffness = 40, ties = { {0, 1} } } },\n"
      "  integrator = 'rk4', dt = 0.01, duration = 1, " +
          error + " }\n");
  return file;
}

}  // namespace

TEST_CASE("what does not go with --error is refused with a remedy", "[cli][error]") {
  const auto refused = [](std::vector<std::string> words, const std::string& part) {
    words.insert(words.begin(), "scenes/cloth.lua");
    const Outcome outcome = run_sim(words);
    INFO(part << '\n' << outcome.err);
    CHECK(outcome.code == 2);
    CHECK(has(outcome.err, "sim: error: "));
    CHECK(has(outcome.err, part));
    CHECK(has(outcome.err, "; "));
    CHECK(outcome.out.empty());
  };
  for (const char* bad : {"-1", "0", "1 furlong", "nan", "inf", "1e999", "%", "mm"})
    refused({"--error", bad}, "--error '" + std::string(bad) + "'");
  refused({"--error", "1mm", "--resume", "none"}, "not with --error: --resume");
  refused({"--error", "1mm", "--steps", "3"}, "give --time instead");
  refused({"--error", "1mm", "-i", "dopri5", "--tol", "1e-3"}, "not with --error: --tol");
  refused({"--error", "1mm", "--from-rest"}, "not with --error: --from-rest");
  refused({"--error", "1mm", "-T", "0"}, "the run has no length");
  refused({"--error", "1mm", "-i", "dopri"}, "unknown integrator 'dopri'");
  refused({"--error", "1mm", "--of", "mean none"}, "none");
  refused({"--until-horizon"}, "add --error E");
  const Outcome verb = run_sim({"minimal", "scenes/cloth.lua", "--error", "1mm"});
  CHECK(verb.code == 2);
  CHECK(has(verb.err, "sim minimal does not take it"));
}

TEST_CASE("the run of --error is that of the command it names", "[cli][error]") {
  const Outcome chosen =
      run_sim({"scenes/cloth.lua", "--error", "1 mm", "-T", "0.5", "--json", "-q"});
  REQUIRE(chosen.code == 0);
  read_json(chosen.out);
  const auto text_after = [&](const std::string& key) {
    const std::size_t at = chosen.out.find("\"" + key + "\":\"") + key.size() + 4;
    return chosen.out.substr(at, chosen.out.find('"', at) - at);
  };
  std::istringstream words(text_after("command"));
  std::vector<std::string> command;
  for (std::string word; words >> word;) command.push_back(word);
  REQUIRE(command.size() > 2);
  command.erase(command.begin());
  command.insert(command.end(), {"--json", "-q"});
  const Outcome again = run_sim(command);
  CHECK(again.code == 0);
  CHECK(has(again.out, "\"hash\":\"" + text_after("hash") + "\""));
  CHECK_FALSE(has(again.out, "error_goal"));
}

TEST_CASE("a scene asks for an error, and the command line for a step", "[cli][error]") {
  const TemporaryFolder folder;
  for (const char* error : {"error = 1e-3", "error = '1 mm'", "error = '0.1%'"}) {
    const Outcome outcome = run_sim({pendulum(folder, error), "--json", "-q"});
    INFO(error << outcome.err);
    CHECK(outcome.code == 0);
    CHECK(has(outcome.out, "\"error_goal\":{\"allowed\":0.001,"));
    CHECK(has(outcome.out, "\"kept\":true"));
  }
  CHECK(has(run_sim({pendulum(folder, "error = 1e-3"), "--steps", "3", "--json", "-q"}).out,
            "\"integrator\":\"rk4\",\"dt\":0.01,\"steps\":3"));
  for (const char* error : {"error = 0", "error = -1", "error = '1 furlong'", "error = {}"}) {
    const Outcome outcome = run_sim({pendulum(folder, error)});
    INFO(error << outcome.err);
    CHECK(outcome.code == 3);
    CHECK(has(outcome.err, "swing.lua"));
  }
}

TEST_CASE("an error that chaos does not let keep ends with 8, or the run before it",
          "[cli][error]") {
  const Outcome outcome = run_sim({"scenes/lorenz.lua", "--error", "1%", "--json", "-q"});
  CHECK(outcome.code == 8);
  CHECK(has(outcome.out, "\"kept\":false"));
  CHECK(has(outcome.err, "check failed: lorenz, error: "));
  CHECK(has(outcome.err, "--until-horizon"));
  const Outcome shorter =
      run_sim({"scenes/lorenz.lua", "--error", "1%", "--until-horizon", "--json", "-q"});
  CHECK(shorter.code == 0);
  CHECK_FALSE(has(shorter.out, "\"t\":40,"));
}

TEST_CASE("the prompt takes an error for its step", "[cli][error]") {
  const auto answer = [](const std::string& input) {
    return run_sim({"scenes/pendulum.lua", "--mode", "json"},
                   {.program = SIM_REPL_BINARY, .input = input});
  };
  const Outcome outcome = answer(".error 1mm\n.dt\n.integrator\n");
  INFO(outcome.out << outcome.err);
  CHECK(has(outcome.out, "\"kept\":true"));
  CHECK(has(outcome.out, "{\"name\":\"pefrl\"}"));
  for (const char* bad : {".error", ".error 0", ".error 1 furlong"}) {
    INFO(bad);
    CHECK(has(answer(std::string(bad) + "\n").err, "error"));
  }
}
