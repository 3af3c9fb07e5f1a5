// The command line of `simrepl`, checked.
#pragma once

#include <string>
#include <vector>

#include "cli/prompt/repl_session.h"
#include "cli/run/environment.h"

namespace sim::cli {

struct ReplCommandLine {
  std::string message;  // --help or --version: a text for standard output, and nothing else to do
  SessionRequest session;
  struct Source {
    bool file = false;  // its name, or else code
    std::string text;
  };
  std::vector<Source> sources;  // -e and -f, in their order
  Mode mode = Mode::kText;
  std::string resume;   // a checkpoint
  std::string record;   // --record: a file for changes
  std::string init;     // --init: a file for the start, "none" for none; else one of one's own at a
                        // terminal
  Folders plugin_path;  // --plugin-path
  Folders libraries;    // --load
  bool probe = false;   // --probe
};

// Throws Error{kUsage} for all errors that can be found before any file is read.
ReplCommandLine parse_repl_command_line(int argc, const char* const* argv);

}  // namespace sim::cli
