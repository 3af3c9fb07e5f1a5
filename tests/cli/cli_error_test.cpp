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

// A push of 1 N s within 0.01 s, far below the size of a fall of 176 m, that steps by a
// tolerance go past.
TEST_CASE("an error is not kept beyond a pulse that no step has seen", "[cli][error]") {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "push.lua").string();
  write_text(file,
             "local sim = require 'sim'\n"
             "local p = sim.particles { mass = 1 }\n"
             "p:add({0, 0, 0}, { velocity = {1, 0, 0} })\n"
             "return sim.scene { name = 'push', particles = p, integrator = 'rk4', dt = 0.01,\n"
             "  duration = 6, forces = { sim.force.gravity { g = {0, -9.81, 0} },\n"
             "  sim.force.expression { fx = '100*step(t - 3.1)*step(3.11 - t)' } } }\n");
  for (const char* more : {"--json", "--until-horizon"}) {
    const Outcome outcome = run_sim({file, "--error", "1%", "-i", "dopri5", "-q", more});
    INFO(outcome.err);
    CHECK(outcome.code == 8);
    CHECK(has(outcome.err, "suspect: a force has a pulse near t = 3.1"));
    CHECK(has(outcome.err, "check failed: push, error: "));
    CHECK(has(outcome.err, "no step has seen a pulse"));
    CHECK(has(outcome.out, "\"kept\":false") == (more == std::string("--json")));
  }
  // Steps begin with four in the pulse where the choice is free.
  for (const std::vector<std::string>& own :
       {std::vector<std::string>{"-i", "verlet", "-d", "1e-4"}, {}}) {
    std::vector<std::string> words{file, "--error", "1%", "-q"};
    words.insert(words.end(), own.begin(), own.end());
    const Outcome fine = run_sim(words);
    INFO(fine.err);
    CHECK(fine.code == 0);
  }
}

// Steps of verlet are off by 2 % of the velocity within this pulse, which seven of them see.
TEST_CASE("an error is kept through a pulse that steps have seen", "[cli][error]") {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "pulse.lua").string();
  write_text(file,
             "local sim = require 'sim'\n"
             "local p = sim.particles { mass = 0.5 }\n"
             "p:add({0, 0, 0}) p:add({1, 0, 0}) p:pin(0)\n"
             "return sim.scene { particles = p, integrator = 'verlet', dt = 6 / 420,\n"
             "  duration = 6, forces = { sim.force.spring { stiffness = 0.5, rest = 0.8,\n"
             "  ties = { {0, 1} } }, sim.force.expression {\n"
             "  fx = '40*exp(-((t-4.357)/0.0275)^2)', fy = '0', fz = '0' } } }\n");
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--error", "0.1%"}}) {
    std::vector<std::string> words{file, "-q"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run_sim(words);
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK_FALSE(has(outcome.err, "pulse"));
  }
}

TEST_CASE("auto without a step or a tolerance keeps 0.1 % of the size", "[cli][error]") {
  const auto run = [](std::vector<std::string> more) {
    std::vector<std::string> words{"scenes/cloth.lua", "-T", "0.5", "--json", "-q"};
    words.insert(words.end(), more.begin(), more.end());
    return run_sim(words);
  };
  const auto hash = [](const Outcome& outcome) {
    return outcome.out.substr(outcome.out.find("\"hash\":"), 26);
  };
  const Outcome chosen = run({"-i", "auto"});
  CHECK(has(chosen.out, "\"error_goal\":{\"allowed\":0.001"));
  CHECK(hash(chosen) == hash(run({"--error", "0.1%"})));
  const Outcome finer = run({"-i", "auto", "--error", "0.001%"});
  CHECK(has(finer.out, "\"error_goal\":{\"allowed\":1.2"));
  CHECK_FALSE(has(finer.out, "\"integrator\":\"auto\""));
  for (const std::vector<std::string>& own :
       {std::vector<std::string>{"-d", "0.001"}, {"--tol", "1e-4"}, {"--from-rest"}}) {
    std::vector<std::string> words{"-i", "auto"};
    words.insert(words.end(), own.begin(), own.end());
    const Outcome outcome = run(words);
    INFO(own.front() << '\n' << outcome.err);
    CHECK(outcome.code == 0);
    CHECK(has(outcome.out, "\"integrator\":\"auto\""));
    CHECK_FALSE(has(outcome.out, "error_goal"));
  }
  // An error that nobody asked for is no failed check.
  const Outcome chaos = run_sim({"scenes/lorenz.lua", "-i", "auto", "--json", "-q"});
  CHECK(chaos.code == 0);
  CHECK(has(chaos.out, "\"kept\":false"));
  CHECK(run_sim({"scenes/cloth.lua", "-i", "auto", "-T", "0", "-q"}).code == 0);
}

TEST_CASE("where trials tell nothing auto looks at the scene", "[cli][error]") {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "pole.lua").string();
  write_text(file,  // x = 1 / (1 - t) ends at t = 1
             "local sim = require 'sim'\n"
             "return sim.scene { state = {1}, field = sim.field.formula { 'x^2', names = {'x'} },\n"
             "  integrator = 'rk4', dt = 0.01, duration = 2 }\n");
  const Outcome outcome = run_sim({file, "-i", "auto", "--json"});
  INFO(outcome.err);
  CHECK(outcome.code != 0);
  CHECK(has(outcome.err, "'auto' chooses as it goes"));
  CHECK_FALSE(has(outcome.out, "error_goal"));
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
