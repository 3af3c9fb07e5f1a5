#include "core/output/output.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/error.h"
#include "core/base/system_failure.h"
#include "core/output/file_plan.h"
#include "core/output/stream.h"

namespace sim {
namespace {

namespace fs = std::filesystem;

bool is_standard_output(const std::string& name) {
  return name == "-" || name == "/dev/stdout" || name == "/dev/fd/1" || name == "/proc/self/fd/1";
}

constexpr std::string_view kTemporary = ".sim-";  // how names of temporary files begin

// The number of the error that stopped it; 0 if all was written.
int write_bytes(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
    if (count >= 0)
      bytes.remove_prefix(static_cast<std::size_t>(count));
    else if (errno != EINTR)
      return errno;
  }
  return 0;
}

}  // namespace

bool is_stream(const std::string& name) {
  if (name.starts_with("/dev/") || name.starts_with("/proc/self/fd/")) return true;
  std::error_code error;
  const fs::file_status status = fs::status(name, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

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
    open(name_);
  }
}

Output::Output(const std::string& file) : Output(file, file) {}

Output::Output(const std::string& file, const std::string& name) : name_(name) { open(file); }

void Output::open(const std::string& file) {
  if (is_stream(file)) {
    descriptor_ = ::open(file.c_str(), O_WRONLY | O_APPEND | O_NOCTTY | O_CLOEXEC);
    if (descriptor_ < 0) fail(errno);
  } else {
    create_beside(resolved_file(file));
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
    descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
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
  throw Error(ErrorKind::kIo,
              {"cannot write", name_, std::strerror(error), remedy_for_writing(error)});
}

void Output::write() {
  const off_t whole = replaces_ ? ::lseek(descriptor_, 0, SEEK_CUR) : -1;
  if (stream_ != nullptr) {
    put(*stream_, buffer_);
    flush_or_throw(*stream_, name_);
  } else {
    const int error = write_bytes(descriptor_, buffer_);
    if (error == EPIPE) throw ClosedPipe();
    if (error != 0) {
      buffer_.clear();
      // A file that grows ends with the last whole piece.
      if (whole >= 0 && ::ftruncate(descriptor_, whole) == 0) ::lseek(descriptor_, whole, SEEK_SET);
      fail(error);
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

// Names the unnamed file: its final name if that is free, or else one for a moment, for only a
// rename replaces. Where the system cannot name it, a copy takes its place.
void Output::name_unnamed(const fs::path& folder) {
  const std::string self = "/proc/self/fd/" + std::to_string(descriptor_);
  ::flock(descriptor_, LOCK_EX | LOCK_NB);
  fs::path name = final_;
  const auto link = [&] {
    return ::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
  };
  if (link()) return;
  if (errno == EEXIST) collect_leftovers(folder);
  errno = EEXIST;
  for (int attempt = 0; errno == EEXIST && attempt <= 100; ++attempt) {
    name = folder / (std::string(kTemporary) + std::to_string(::getpid()) + "-" +
                     std::to_string(attempt) + ".tmp");
    if (!link()) continue;
    temporary_ = std::move(name);
    return;
  }
  copy_unnamed(folder);
}

void Output::copy_unnamed(const fs::path& folder) {
  std::string block(kChunk, '\0');
  struct stat status {};
  const int copy = open_temporary(folder, "", temporary_);
  if (copy < 0) {
    const int error = errno;
    temporary_.clear();
    fail(error);
  }
  if (::fstat(descriptor_, &status) == 0) ::fchmod(copy, status.st_mode & 07777);
  int error = 0;
  for (off_t at = 0; error == 0;) {
    const ssize_t count = ::pread(descriptor_, block.data(), block.size(), at);
    if (count == 0) break;
    if (count < 0 && errno == EINTR) continue;
    error = count < 0 ? errno : write_bytes(copy, {block.data(), static_cast<std::size_t>(count)});
    at += count;
  }
  ::close(std::exchange(descriptor_, copy));
  if (error != 0) fail(error);
}

// A failure before the rename leaves the old file; after it the new one is there.
void Output::take_name(bool durable, bool stays_open) {
  if (descriptor_ < 0) return;
  const fs::path folder = final_.parent_path();
  const auto sync = [&] {
    if (durable && !final_.empty() && ::fsync(descriptor_) != 0) fail(errno);
  };
  sync();
  // A network's file system says only at a close what went wrong before.
  if (const int copy = ::dup(descriptor_); copy >= 0 && ::close(copy) != 0) fail(errno);
  if (!final_.empty() && temporary_.empty()) {
    const int unnamed = descriptor_;
    name_unnamed(folder);
    if (descriptor_ != unnamed) sync();
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
