// The answers to NAME?, and the completions that Tab offers.
#pragma once

#include <string>
#include <vector>

#include "cli/prompt/repl_session.h"

namespace sim::cli {

std::string help_list();  // all commands

// Help on a command, a function of the scene language, a plugin or a scene, in its own words.
// Throws Error{kUsage} for a name that is none of these, with the nearest one.
std::string help_on(Session& session, const std::string& name);

// Candidates for the last word of the line, each from its first letter on: commands and their
// arguments, names of Lua, plugins, files (with `files` set, for these the caller knows better).
struct Completions {
  std::vector<std::string> words;
  bool files = false;
};
Completions complete(Session& session, const std::string& line, std::size_t word_begin);

}  // namespace sim::cli
