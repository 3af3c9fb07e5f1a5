#include "core/engine/engine_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>

#include "core/base/error.h"
#include "core/engine/temporary.h"

namespace sim::engine {
namespace {

constexpr const char* kFolder = "sim-engine-";

// The open folder, or -1 where another process holds it.
int lock(const std::string& folder) {
  const int held = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (held < 0 || ::flock(held, LOCK_EX | LOCK_NB) == 0) return held;
  ::close(held);
  return -1;
}

// Folders of processes that were killed. One that is a minute old and not held is such.
void remove_leftovers() {
  namespace fs = std::filesystem;
  std::error_code failed;
  for (fs::directory_iterator entry(temporary_folder(), failed), end; !failed && entry != end;
       entry.increment(failed)) {
    struct stat status {};
    if (!entry->path().filename().string().starts_with(kFolder) ||
        ::lstat(entry->path().c_str(), &status) != 0 || !S_ISDIR(status.st_mode) ||
        status.st_uid != ::geteuid() || status.st_ctime + 60 > ::time(nullptr))
      continue;
    const int held = lock(entry->path().string());
    std::error_code ignored;
    if (held >= 0) fs::remove_all(entry->path(), ignored);
    if (held >= 0) ::close(held);
  }
}

}  // namespace

EngineFolder::EngineFolder() {
  remove_leftovers();
  path_ = (temporary_folder() / (std::string(kFolder) + "XXXXXX")).string();
  if (!::mkdtemp(path_.data()))
    throw Error(ErrorKind::kIo, {"cannot make a folder", path_, std::strerror(errno),
                                 "TMPDIR says where folders of a moment are"});
  held_ = lock(path_);
}

EngineFolder::~EngineFolder() {
  // Open MPI may still write files while it ends, so that removal is retried.
  constexpr int kTries = 50;  // 10 ms apart
  std::error_code ignored;
  for (int tried = 0; tried < kTries && std::filesystem::exists(path_, ignored); ++tried) {
    const timespec moment{0, tried == 0 ? 0 : 10'000'000};
    ::nanosleep(&moment, nullptr);
    std::filesystem::remove_all(path_, ignored);
  }
  if (held_ >= 0) ::close(held_);
}

}  // namespace sim::engine
