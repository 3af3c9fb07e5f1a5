// The loop of a session: lines from a terminal, a pipe, files or the command line.
#pragma once

#include "cli/command_line/repl_options.h"
#include "cli/terminal/console.h"

namespace sim::cli {

// Returns the exit code. At a terminal an error is reported and the session continues; elsewhere
// the first one ends it with its code.
int repl(const ReplCommandLine& line, const Environment& environment, Registry& registry,
         Console& console);

}  // namespace sim::cli
