// Completions at the prompt: what each command takes, from its first letters on.
#include <algorithm>
#include <catch2/catch.hpp>
#include <sstream>

#include "cli/prompt/repl_commands.h"
#include "cli/prompt/repl_help.h"
#include "cli/run/environment.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::cli;
using Names = std::vector<std::string>;

namespace {

struct AtPrompt {
  std::ostringstream out, err;
  Console console{out, err};
  Registry registry = sim_test::make_registry();
  Environment environment = find_environment({});
  Session session;

  explicit AtPrompt(const std::string& scene)
      : session({.scene = {.scene = scene}}, environment, registry, console) {}

  // Completions of the last word of a line.
  Completions after(const std::string& line) {
    return complete(session, line, line.find_last_of(' ') + 1);
  }
  Names words(const std::string& line) { return after(line).words; }
};

Names with(const Names& names, const std::string& beginning) {
  Names found;
  for (const std::string& name : names)
    if (name.starts_with(beginning)) found.push_back(name);
  std::ranges::sort(found);
  return found;
}

bool has(const Names& names, const std::string& name) {
  return std::ranges::count(names, name) == 1;
}

}  // namespace

TEST_CASE("Tab offers every command, and what each takes") {
  AtPrompt prompt("scenes/pendulum.lua");
  Names all;
  for (const Command& each : commands()) all.push_back("." + std::string(each.name));
  CHECK(prompt.words(".") == with(all, "."));
  CHECK(prompt.words("  .st") == with(all, ".st"));
  CHECK(prompt.words(".zz").empty());

  const Names methods = prompt.registry.names<Integrator>();
  for (const char* command : {"integrator", "order", "stability"}) {
    INFO(command);
    CHECK(prompt.words("." + std::string(command) + " ") == with(methods, ""));
    CHECK(prompt.words("." + std::string(command) + " rk") == with(methods, "rk"));
    CHECK_FALSE(prompt.after("." + std::string(command) + " ").files);
  }
  CHECK(prompt.words(".mode ") == Names{"csv", "json", "text"});
  CHECK(prompt.words(".mode j") == Names{"json"});
  CHECK(prompt.words(".set ") == Names{"n"});
  CHECK(has(prompt.words(".plugins "), "scenes"));
  CHECK(has(prompt.words(".plugins "), "integrators"));
  const Names help = prompt.words(".help ");
  for (const char* name : {"step", "verlet", "gravity", "help"}) CHECK(has(help, name));
  CHECK(has(prompt.words(".open "), "scenes/cloth.lua"));
  for (const char* command : {"snap", "resume", "dump", "read", "open", "load", "save"}) {
    INFO(command);
    CHECK(prompt.after("." + std::string(command) + " ").files);
  }
  CHECK(prompt.words(".nothing x").empty());
}

TEST_CASE("Tab offers branches, plots and systems that are there") {
  AtPrompt prompt("scenes/sample.lua");
  const Names systems = prompt.session.live().scene().names();
  CHECK(prompt.words(".system ") == with(systems, ""));
  CHECK(systems.size() > 1);
  prompt.session.take(".branch side", "test", 1);
  CHECK(has(prompt.words(".switch "), "side"));
  CHECK(has(prompt.words(".diff s"), "side"));
  CHECK_FALSE(has(prompt.words(".system "), "side"));
  prompt.session.take("height = 3", "test", 2);
  CHECK(has(prompt.words("hei"), "height"));
  CHECK(has(prompt.words("x = hei"), "height"));
  CHECK(has(prompt.words("sim.for"), "sim.force"));
  CHECK(has(prompt.words("sim.force.gr"), "sim.force.gravity"));
  CHECK(prompt.words("sim.force.zz").empty());
}
