// Compression and checksums of file formats, by zlib.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>

struct z_stream_s;

namespace sim {

// A zlib stream (RFC 1950); level 1 (quick) to 9 (small).
std::string deflated(std::string_view bytes, int level = 6);

// The same stream for bytes that come in blocks.
class Deflater {
 public:
  // Nothing is stored beyond `most` bytes.
  explicit Deflater(int level, std::size_t most = std::numeric_limits<std::size_t>::max());
  ~Deflater();
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  void add(std::string_view bytes);
  bool full() const { return full_; }  // there were more than `most`
  std::string finish();

 private:
  void run(int flush);

  std::unique_ptr<z_stream_s> stream_;
  std::string out_;
  std::size_t most_;
  bool full_ = false;
};

std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0);

// The checksum of two blocks, one after the other; the second has so many bytes.
std::uint32_t joined_crc32(std::uint32_t first, std::uint32_t second, std::uint64_t bytes);

}  // namespace sim
