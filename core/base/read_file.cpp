#include "core/base/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/base/system_failure.h"

namespace sim {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;

struct Descriptor {
  int number = -1;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

[[noreturn]] void fail(ErrorText text, int error) {
  text.why = error == EISDIR ? "it is a folder" : std::strerror(error);
  if (text.remedy.empty() || is_machine_failure(error)) text.remedy = remedy_for(error);
  if (text.remedy.empty()) text.remedy = "name a file that can be read";
  throw Error(ErrorKind::kIo, text);
}

[[noreturn]] void refuse_size(ErrorText text, std::size_t limit) {
  text.why = "it is larger than " + std::to_string(limit >> 20) + " MB";
  text.remedy = "name a smaller file";
  throw Error(ErrorKind::kIo, text);
}

}  // namespace

std::string read_whole_file(const std::filesystem::path& file, const ErrorText& failure,
                            std::size_t limit) {
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY)};
  if (in.number < 0) fail(failure, errno);
  struct stat status {};
  if (::fstat(in.number, &status) != 0) fail(failure, errno);
  const auto size = static_cast<std::size_t>(S_ISREG(status.st_mode) ? status.st_size : 0);
  if (size > limit) refuse_size(failure, limit);
  std::string bytes;
  // One block more than the file has: the read that finds its end makes no larger string.
  for (std::size_t filled = 0;;) {
    bytes.resize(std::max(filled, size) + kBlock);
    const ssize_t count = ::read(in.number, bytes.data() + filled, bytes.size() - filled);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(failure, errno);
    filled += static_cast<std::size_t>(count);
    if (filled > limit) refuse_size(failure, limit);
    if (count == 0) {
      bytes.resize(filled);
      return bytes;
    }
  }
}

}  // namespace sim
