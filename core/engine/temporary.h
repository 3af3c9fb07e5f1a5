// The folder in which temporary files and folders are made.
#pragma once

#include <filesystem>

namespace sim::engine {

// $TMPDIR, or else /tmp. Throws Error{kIo} where that is no folder.
std::filesystem::path temporary_folder();

}  // namespace sim::engine
