// Exceptions that were thrown by code of plugins and libraries.
#pragma once

#include <optional>
#include <string>

namespace sim {

// The words of the exception that is being handled; nothing for what is no exception. Errors, and
// memory that ran out, are not of others: they are thrown again.
std::optional<std::string> thrown_by_others();

}  // namespace sim
