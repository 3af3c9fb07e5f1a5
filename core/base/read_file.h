// Whole files as text.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "core/base/error.h"

namespace sim {

constexpr std::size_t kLargestInput = std::size_t{1} << 30;  // bytes

// The bytes of a file. A read that fails is an error, and never the end of the file. Throws
// Error{kIo} with `failure`, to which it adds why, and a remedy where the machine is the reason or
// `failure` has none: it cannot be opened or read, is a folder, or is larger than the limit.
std::string read_whole_file(const std::filesystem::path& file, const ErrorText& failure,
                            std::size_t limit = kLargestInput);

}  // namespace sim
