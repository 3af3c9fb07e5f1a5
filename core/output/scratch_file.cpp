#include "core/output/scratch_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/base/error.h"

namespace sim {

ScratchFile::ScratchFile(const std::string& result) : result_(result) {
  namespace fs = std::filesystem;
  std::error_code failed;
  const fs::path whole = fs::weakly_canonical(fs::absolute(result, failed), failed);
  const bool device = whole.string().starts_with("/dev/");
  const fs::path folder = device ? fs::temp_directory_path(failed) : whole.parent_path();
  std::string name = (folder / ".sim-frames.tmpXXXXXX").string();
  file_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (file_ < 0) fail(errno);
  ::unlink(name.c_str());
}

ScratchFile::~ScratchFile() { ::close(file_); }

void ScratchFile::fail(int error) const {
  throw Error(ErrorKind::kIo, {"cannot keep what " + result_ + " will be made of", result_,
                               error == 0 ? "it is cut off" : std::strerror(error),
                               "check the folder, its permissions and the space there"});
}

std::uint64_t ScratchFile::append(std::string_view bytes) {
  const std::uint64_t begin = size_;
  while (!bytes.empty()) {
    const ssize_t count = ::pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(size_));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(errno);
    size_ += static_cast<std::uint64_t>(count);
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return begin;
}

void ScratchFile::read(std::uint64_t at, char* to, std::size_t count) const {
  while (count > 0) {
    const ssize_t done = ::pread(file_, to, count, static_cast<off_t>(at));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) fail(done < 0 ? errno : 0);
    at += static_cast<std::uint64_t>(done);
    to += done;
    count -= static_cast<std::size_t>(done);
  }
}

void append_scratch(Output& output, const ScratchFile& from, std::uint64_t at,
                    std::uint64_t count) {
  constexpr std::uint64_t kBlock = 1 << 18;
  std::string block;
  while (count > 0) {
    block.resize(static_cast<std::size_t>(std::min(count, kBlock)));
    from.read(at, block.data(), block.size());
    output.buffer() += block;
    output.flush_if_full();
    at += block.size();
    count -= block.size();
  }
}

}  // namespace sim
