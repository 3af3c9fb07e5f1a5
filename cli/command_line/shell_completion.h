// Completion scripts for shells, generated from the declarations of the command lines.
#pragma once

#include <string>

#include "cli/command_line/command_spec.h"

namespace sim::cli {

// A script for bash, zsh or fish: verbs, options, files, and the names of plugins and scenes, for
// which it asks `sim list WHAT --names`. Throws Error{kUsage} for another shell.
std::string shell_completion(const CommandSpec& program, const std::string& shell);

}  // namespace sim::cli
