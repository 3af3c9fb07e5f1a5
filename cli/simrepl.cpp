// simrepl: a scene at a prompt.
#include "cli/prompt/repl.h"
#include "cli/run/environment.h"
#include "cli/terminal/console.h"

int main(int argc, char** argv) {
  using namespace sim::cli;
  Console console = standard_console();
  try {
    const ReplCommandLine line = parse_repl_command_line(argc, argv);
    if (!line.message.empty()) {
      console.out << line.message;
      sim::flush_or_throw(console.out, "standard output");
      return 0;
    }
    const Environment environment = find_environment(line.plugin_path);
    sim::Registry registry = open_registry(environment, line.libraries, line.probe);
    return repl(line, environment, registry, console);
  } catch (...) {
    return report_exception(console.err);
  }
}
