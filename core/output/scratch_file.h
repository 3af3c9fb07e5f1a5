// Scratch storage for bytes that need not be in memory before a file is made of them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/output/output.h"

namespace sim {

// A file without a name, which disappears with the process. It is in the folder of the file that
// will be made, where there is as much room, on a disk instead of a memory file system.
class ScratchFile {
 public:
  explicit ScratchFile(const std::string& result);  // the file that will be made; throws Error{kIo}
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  std::uint64_t size() const { return size_; }
  std::uint64_t append(std::string_view bytes);  // returns their offset; throws Error{kIo}
  void read(std::uint64_t at, char* to, std::size_t count) const;  // from any thread

 private:
  [[noreturn]] void fail(int error) const;

  std::string result_;
  int file_ = -1;
  std::uint64_t size_ = 0;
};

// Appends a part of it to a file.
void append_scratch(Output& output, const ScratchFile& from, std::uint64_t at, std::uint64_t count);

}  // namespace sim
