#include "core/output/staging_folder.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/base/error.h"
#include "core/base/system_failure.h"
#include "core/output/output.h"

namespace sim {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& where, int error) {
  throw Error(ErrorKind::kIo,
              {"cannot write", where.string(), std::strerror(error), remedy_for_writing(error)});
}

}  // namespace

StagingFolder::StagingFolder(const fs::path& folder) : folder_(folder.empty() ? "." : folder) {
  make_folder(folder_);
  collect_leftovers(folder_);
  std::string name = (folder_ / (".sim-" + std::to_string(::getpid()) + ".tmpXXXXXX")).string();
  if (!::mkdtemp(name.data())) fail(folder_, errno);
  temporary_ = name;
  lock_ = ::open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ >= 0) ::flock(lock_, LOCK_EX | LOCK_NB);
}

StagingFolder::~StagingFolder() {
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) fs::remove(*folder, ignored);
  if (lock_ >= 0) ::close(lock_);
}

void StagingFolder::make_folder(const fs::path& folder) {
  std::error_code failed;
  if (fs::create_directory(folder, failed)) return made_.push_back(folder);
  if (fs::is_directory(folder)) return;
  throw Error(ErrorKind::kIo, {"cannot make a folder", folder.string(),
                               failed ? failed.message() : "it is a file", "give another name"});
}

void StagingFolder::commit() {
  std::vector<fs::path> names;
  for (const auto& entry : fs::recursive_directory_iterator(temporary_))
    if (!entry.is_directory()) names.push_back(entry.path().lexically_relative(temporary_));
  std::ranges::sort(names);
  // Refusals come before the first file is replaced.
  for (const fs::path& name : names) {
    std::error_code failed;
    const fs::path old = folder_ / name;
    make_folder(old.parent_path());
    const fs::file_status status = fs::status(old, failed);
    if (!fs::exists(status)) continue;
    if (fs::is_directory(status)) fail(old, EISDIR);
    if (::access(old.c_str(), W_OK) != 0) fail(old, errno);
    fs::permissions(temporary_ / name, status.permissions(), failed);
  }
  std::size_t placed = 0;
  while (placed < names.size() && place(names[placed])) ++placed;
  if (placed < names.size()) {
    const int error = errno;
    for (std::size_t i = placed; i-- > 0;) take_back(names[i]);
    fail(folder_ / names[placed], error);
  }
  made_.clear();
}

// An older file takes the new one's place in the temporary folder, so that all can be taken back.
bool StagingFolder::place(const fs::path& name) const {
  const fs::path from = temporary_ / name, to = folder_ / name;
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) == 0) return true;
  const bool unable = errno == ENOENT || errno == EINVAL || errno == ENOSYS;
  return unable && ::rename(from.c_str(), to.c_str()) == 0;
}

void StagingFolder::take_back(const fs::path& name) const {
  const fs::path from = folder_ / name, to = temporary_ / name;
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) != 0)
    ::rename(from.c_str(), to.c_str());
}

}  // namespace sim
