#include "core/output/output.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/error.h"
#include "core/output/file_plan.h"
#include "core/output/stream.h"

namespace sim {
namespace {

namespace fs = std::filesystem;

bool is_standard_output(const std::string& name) {
  return name == "-" || name == "/dev/stdout" || name == "/dev/fd/1" || name == "/proc/self/fd/1";
}

// Opened as it is, never replaced: devices, named pipes, and whatever /dev/fd/N stands for.
bool is_stream(const std::string& name) {
  if (name.starts_with("/dev/") || name.starts_with("/proc/self/fd/")) return true;
  std::error_code error;
  const fs::file_status status = fs::status(name, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

constexpr std::string_view kTemporary = ".sim-";  // how names of temporary files begin

}  // namespace

Target parse_target(std::string_view option, const std::string& text, bool plots) {
  if (is_standard_output(text)) return {};
  if (plots && text.ends_with(".svg")) return {text, TableFormat::kSvg};
  if (text.ends_with(".jsonl")) return {text, TableFormat::kJsonLines};
  if (text.ends_with(".csv") || is_stream(text)) return {text, TableFormat::kCsv};
  throw Error(ErrorKind::kUsage, {"unknown table format", std::string(option) + "=" + text,
                                  "the name of a table ends in .csv or .jsonl",
                                  "rename it, or leave it out to write "
                                  "CSV to standard output"});
}

Output::Output(const Target& target, std::ostream& standard_output) : name_(target.file) {
  if (target.standard_output()) {
    name_ = "standard output";
    stream_ = &standard_output;
    buffer_.reserve(kRoom);
  } else {
    open();
  }
}

Output::Output(const std::string& file) : name_(file) { open(); }

void Output::open() {
  if (is_stream(name_)) {
    descriptor_ = ::open(name_.c_str(), O_WRONLY | O_APPEND | O_NOCTTY | O_CLOEXEC);
    if (descriptor_ < 0) fail(errno);
  } else {
    create_beside(resolved_file(name_));
  }
  buffer_.reserve(kRoom);
}

int open_temporary(const fs::path& folder, const std::string& ending, fs::path& path) {
  for (int attempt = 0;; ++attempt) {
    path = folder / (std::string(kTemporary) + std::to_string(::getpid()) + "-" +
                     std::to_string(attempt) + ".tmp" + ending);
    const int made = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (made >= 0) {
      ::flock(made, LOCK_EX | LOCK_NB);
      return made;
    }
    if (errno != EEXIST || attempt == 100) return -1;
  }
}

void collect_leftovers(const fs::path& folder) {
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(kTemporary) || name.find(".tmp") == std::string::npos) continue;
    const int file = ::open(entry->path().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) continue;
    struct stat status {};
    std::error_code ignored;
    if (::fstat(file, &status) == 0 && (S_ISREG(status.st_mode) || S_ISDIR(status.st_mode)) &&
        status.st_uid == ::geteuid() && ::flock(file, LOCK_EX | LOCK_NB) == 0)
      fs::remove_all(entry->path(), ignored);
    ::close(file);
  }
}

// The new file lies in the same folder, so that the rename at the end is one atomic step. It keeps
// the permissions of the file it replaces.
void Output::create_beside(const fs::path& file) {
  struct stat old {};
  const bool exists = ::stat(file.c_str(), &old) == 0;
  if (exists && S_ISDIR(old.st_mode)) fail(EISDIR);
  if (exists && ::access(file.c_str(), W_OK) != 0) fail(errno);
  const fs::path folder = file.parent_path();
#ifdef O_TMPFILE
  if (::access("/proc/self/fd", X_OK) == 0)
    descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
#endif
  if (descriptor_ < 0) {
    collect_leftovers(folder);
    descriptor_ = open_temporary(folder, "", temporary_);
  }
  if (descriptor_ < 0) {
    const int error = errno;
    temporary_.clear();
    fail(error);
  }
  if (exists) ::fchmod(descriptor_, old.st_mode & 07777);
  final_ = file;
  replaces_ = true;
}

Output::~Output() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void Output::fail(int error) const {
  throw Error(ErrorKind::kIo, {"cannot write", name_, std::strerror(error),
                               "check the folder, its permissions and the space there"});
}

void Output::write() {
  const off_t whole = replaces_ ? ::lseek(descriptor_, 0, SEEK_CUR) : -1;
  if (stream_ != nullptr) {
    put(*stream_, buffer_);
    flush_or_throw(*stream_, name_);
  } else {
    for (std::size_t done = 0; done < buffer_.size();) {
      const ssize_t count = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
      if (count >= 0) {
        done += static_cast<std::size_t>(count);
      } else if (errno == EPIPE) {
        throw ClosedPipe();
      } else if (errno != EINTR) {
        const int error = errno;
        buffer_.clear();
        // A file that grows ends with the last whole piece.
        if (whole >= 0 && ::ftruncate(descriptor_, whole) == 0)
          ::lseek(descriptor_, whole, SEEK_SET);
        fail(error);
      }
    }
  }
  buffer_.clear();
}

void Output::commit() {
  write();
  take_name(false);
}

void Output::publish() {
  write();
  take_name(false, true);
}

void Output::commit_safely() {
  write();
  take_name(true);
}

// A file without a name gets its final one if that is free, or else one for a moment, for only a
// rename replaces. What fails before leaves the old file; after it the new one is there.
void Output::take_name(bool durable, bool stays_open) {
  if (descriptor_ < 0) return;
  const fs::path folder = final_.parent_path();
  if (durable && !final_.empty() && ::fsync(descriptor_) != 0) fail(errno);
  // A network's file system says only at a close what went wrong before.
  if (const int copy = ::dup(descriptor_); copy >= 0 && ::close(copy) != 0) fail(errno);
  if (!final_.empty() && temporary_.empty()) {
    const std::string self = "/proc/self/fd/" + std::to_string(descriptor_);
    const auto link = [&](const fs::path& name) {
      return ::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
    };
    fs::path name = final_;
    for (int attempt = 0; !link(name); ++attempt) {
      if (errno != EEXIST || attempt == 100) fail(errno);
      name = folder / (std::string(kTemporary) + std::to_string(::getpid()) + "-" +
                       std::to_string(attempt) + ".tmp");
    }
    if (name != final_) {
      ::flock(descriptor_, LOCK_EX | LOCK_NB);
      temporary_ = name;
    }
  }
  if (!temporary_.empty()) {
    if (::rename(temporary_.c_str(), final_.c_str()) != 0) fail(errno);
    temporary_.clear();
  }
  if (stays_open) return final_.clear();
  ::close(std::exchange(descriptor_, -1));
  if (!durable || final_.empty()) return;
  const int held = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  // Some file systems have no way to sync a folder.
  const int lost = held >= 0 && ::fsync(held) != 0 && errno != EINVAL ? errno : 0;
  if (held >= 0) ::close(held);
  if (lost != 0)
    throw Error(ErrorKind::kIo, {"written, but the folder was not synced", name_,
                                 std::strerror(lost), "the file is whole and was replaced"});
}

}  // namespace sim
