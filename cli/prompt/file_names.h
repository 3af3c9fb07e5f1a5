// Files that a word at the prompt may begin.
#pragma once

#include <string>
#include <vector>

namespace sim::cli {

// Paths that begin with `word`, sorted; those of folders end with '/'. A leading "~/" is the home
// folder. Names that begin with a point are left out unless the word asks for them.
std::vector<std::string> file_names(const std::string& word);

}  // namespace sim::cli
