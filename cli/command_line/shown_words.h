// The words that a command line takes, as its --help shows them.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace sim::cli {

struct ShownOption {
  std::vector<std::string> names;  // "-i", "--integrator"
  std::string type;                // of its value, "FILE"; "" = it takes none
  std::string doc;                 // one line
};

struct ShownCommand {
  std::string name, doc;
  std::vector<ShownOption> options;
  std::vector<ShownCommand> verbs;
};

ShownCommand shown_words(const CLI::App& app);

}  // namespace sim::cli
