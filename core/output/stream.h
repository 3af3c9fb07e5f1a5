// Writing to standard streams so that a full disk and a closed pipe are told apart.
#pragma once

#include <exception>
#include <ostream>
#include <string_view>

namespace sim {

// Thrown when the reader of a pipe has gone away: nobody is left to be told.
struct ClosedPipe : std::exception {};

// Writes and flushes; what goes wrong stays in the stream's state and in errno.
void put(std::ostream& stream, std::string_view text);

// Flushes; throws ClosedPipe, or Error{kIo} when what was written so far did not arrive.
void flush_or_throw(std::ostream& stream, std::string_view name);

}  // namespace sim
