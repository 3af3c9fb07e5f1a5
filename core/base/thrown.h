// Exceptions thrown by code of plugins and libraries.
#pragma once

#include <optional>
#include <string>

namespace sim {

// The text of the current exception; empty if it is no std::exception. Errors of ours, and
// exhausted memory, are rethrown.
std::optional<std::string> thrown_by_others();

}  // namespace sim
