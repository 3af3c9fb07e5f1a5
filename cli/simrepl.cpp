// simrepl: a scene at a prompt.
#include <unistd.h>

#include <csignal>
#include <iostream>

#include "cli/console.h"
#include "cli/environment.h"
#include "cli/repl.h"

int main(int argc, char** argv) {
  using namespace sim::cli;
  occupy_standard_streams();
  // A closed pipe is met as a failed write, so that half-written files are cleaned up.
  std::signal(SIGPIPE, SIG_IGN);
  std::ios::sync_with_stdio(false);
  std::cin.tie(nullptr);
  Console console{std::cout, std::cerr, ::isatty(STDERR_FILENO) == 1};
  try {
    const ReplCommandLine line = parse_repl_command_line(argc, argv);
    if (!line.message.empty()) {
      console.out << line.message;
      flush_or_throw(console.out, "standard output");
      return 0;
    }
    const Environment environment = find_environment(line.plugin_path);
    sim::Registry registry = open_registry(environment, line.libraries);
    return repl(line, environment, registry, console);
  } catch (...) {
    return report_exception(std::cerr);
  }
}
