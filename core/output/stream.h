// Writing to standard streams such that a full disk and a closed pipe are distinguished.
#pragma once

#include <exception>
#include <ostream>
#include <string_view>

namespace sim {

// Thrown when the reader of a pipe has gone: nobody is left to be told.
struct ClosedPipe : std::exception {};

// Writes and flushes; errors stay in the stream's state and in errno.
void put(std::ostream& stream, std::string_view text);

// Flushes; throws ClosedPipe, or Error{kIo} if the output so far was not written.
void flush_or_throw(std::ostream& stream, std::string_view name);

}  // namespace sim
