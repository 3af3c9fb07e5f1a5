#include "cli/command_line/command_spec.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace sim::cli {

CommandSpec command_spec(const CLI::App& app) {
  CommandSpec command{app.get_name(), app.get_description(), {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional()) continue;
    OptionSpec shown;
    for (const std::string& name : option->get_snames()) shown.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) shown.names.push_back("--" + name);
    if (option->get_expected_max() > 0) shown.type = option->get_type_name();
    shown.doc = option->get_description();
    std::ranges::replace(shown.doc, '\n', ' ');
    command.options.push_back(std::move(shown));
  }
  for (const CLI::App* verb : app.get_subcommands({})) command.verbs.push_back(command_spec(*verb));
  return command;
}

}  // namespace sim::cli
