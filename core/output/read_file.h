// Files that a user names, read whole. A device, a pipe that nobody writes to and a file larger
// than a limit are refused before anything is read.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "core/base/error.h"

namespace sim {

constexpr std::size_t kLargestInput = std::size_t{1} << 30;  // bytes

// The bytes of a file. A read that fails is an error, and never the end of the file. Throws
// Error{kIo} with `failure`, to which it adds why, and a remedy where the machine is the reason or
// `failure` has none: the file cannot be opened or read, is no regular file (nor a pipe of this
// process, as /dev/stdin and /dev/fd/N may be), or is larger than the limit.
std::string read_whole_file(const std::filesystem::path& file, const ErrorText& failure,
                            std::size_t limit = kLargestInput);

// The same with "cannot read FILE" and this remedy.
std::string read_input_file(const std::string& file, double most, const std::string& remedy);

// Throws as read_input_file(), but reads nothing.
void check_input_file(const std::string& file, double most, const std::string& remedy);

// The limit in bytes of a file that may be as large as a run: a fourth of the memory that is left.
double most_of_memory();

}  // namespace sim
