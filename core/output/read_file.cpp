#include "core/output/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/base/memory.h"
#include "core/base/system_failure.h"
#include "core/base/text.h"

namespace sim {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;

[[noreturn]] void fail(ErrorText text, int error) {
  text.why = error == EISDIR ? "it is a folder" : std::strerror(error);
  if (text.remedy.empty() || is_machine_failure(error)) text.remedy = remedy_for(error);
  if (text.remedy.empty()) text.remedy = "name a file that can be read";
  throw Error(ErrorKind::kIo, text);
}

[[noreturn]] void refuse(ErrorText text, const std::string& why, const std::string& remedy) {
  text.why = why;
  if (text.remedy.empty()) text.remedy = remedy;
  throw Error(ErrorKind::kIo, text);
}

class OpenedFile {
 public:
  OpenedFile(const std::filesystem::path& file, const ErrorText& failure, std::size_t limit)
      : failure_(failure), limit_(limit) {
    const std::string name = file.string();
    const bool own =
        name == "/dev/stdin" || name.starts_with("/dev/fd/") || name.starts_with("/proc/self/fd/");
    // A named pipe without a writer is opened at once, to be refused.
    const int wait = own ? 0 : O_NONBLOCK;
    descriptor_ = ::open(file.c_str(), O_RDONLY | wait | O_NOCTTY | O_CLOEXEC);
    if (descriptor_ < 0) fail(failure, errno);
    try {
      check(own);
    } catch (...) {
      ::close(descriptor_);
      throw;
    }
  }
  ~OpenedFile() { ::close(descriptor_); }
  OpenedFile(const OpenedFile&) = delete;
  OpenedFile& operator=(const OpenedFile&) = delete;

  std::string read() const {
    std::string bytes;
    // One block more than the file has: the read that finds its end makes no larger string.
    for (std::size_t filled = 0;;) {
      bytes.resize(std::max(filled, size_) + kBlock);
      const ssize_t count = ::read(descriptor_, bytes.data() + filled, bytes.size() - filled);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) fail(failure_, errno);
      filled += static_cast<std::size_t>(count);
      check_size(filled);  // it may grow while it is read
      if (count > 0) continue;
      bytes.resize(filled);
      return bytes;
    }
  }

 private:
  void check(bool may_be_pipe) {
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) fail(failure_, errno);
    if (S_ISDIR(status.st_mode)) fail(failure_, EISDIR);
    if (may_be_pipe && S_ISFIFO(status.st_mode)) return;
    if (!S_ISREG(status.st_mode))
      refuse(failure_, "it is not a regular file", "name a regular file");
    size_ = static_cast<std::size_t>(status.st_size);
    check_size(size_);
  }
  void check_size(std::size_t size) const {
    if (size > limit_)
      refuse(failure_, "it is larger than " + bytes_text(static_cast<double>(limit_)),
             "name a smaller file");
  }

  const ErrorText& failure_;
  std::size_t limit_, size_ = 0;  // bytes
  int descriptor_ = -1;
};

std::size_t whole(double bytes) {
  constexpr double kMost = 9e18;
  return static_cast<std::size_t>(std::clamp(bytes, 0.0, kMost));
}

}  // namespace

std::string read_whole_file(const std::filesystem::path& file, const ErrorText& failure,
                            std::size_t limit) {
  return OpenedFile(file, failure, limit).read();
}

std::string read_input_file(const std::string& file, double most, const std::string& remedy) {
  return read_whole_file(file, {"cannot read", file, "", remedy}, whole(most));
}

void check_input_file(const std::string& file, double most, const std::string& remedy) {
  const ErrorText failure{"cannot read", file, "", remedy};
  OpenedFile(file, failure, whole(most));
}

double most_of_memory() { return std::max(64e6, memory_left() / 4); }

}  // namespace sim
