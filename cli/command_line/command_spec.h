// The words that a command line takes, as its --help shows them.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace sim::cli {

struct OptionSpec {
  std::vector<std::string> names;  // "-i", "--integrator"
  std::string type;                // of its value, "FILE"; "" = it takes none
  std::string doc;                 // one line
};

struct CommandSpec {
  std::string name, doc;
  std::vector<OptionSpec> options;
  std::vector<CommandSpec> verbs;
};

CommandSpec command_spec(const CLI::App& app);

}  // namespace sim::cli
