#include "core/engine/temporary.h"

#include <cstdlib>
#include <string>

#include "core/base/error.h"

namespace sim::engine {

std::filesystem::path temporary_folder() {
  std::error_code failed;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(failed);
  if (!failed) return folder;
  const char* const asked = std::getenv("TMPDIR");
  throw Error(ErrorKind::kIo,
              {"no folder for temporary files", asked ? "TMPDIR=" + std::string(asked) : "/tmp",
               failed.message(), "set TMPDIR to a folder that you may write to"});
}

}  // namespace sim::engine
