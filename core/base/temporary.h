// Where files and folders of a moment are made.
#pragma once

#include <filesystem>

namespace sim {

// $TMPDIR, or else /tmp. Throws Error{kIo} where that is no folder.
std::filesystem::path temporary_folder();

}  // namespace sim
