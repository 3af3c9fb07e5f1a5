#include "core/output/deflate.h"

#include <zlib.h>

#include "core/base/error.h"

namespace sim {

std::string deflated(std::string_view bytes, int level) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), level) != Z_OK)
    throw Error(ErrorKind::kIo, {"cannot compress", "", "no memory", ""});
  out.resize(size);
  return out;
}

std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before) {
  uLong sum = before;
  while (!bytes.empty()) {  // zlib counts in 32 bits
    const std::size_t part = bytes.size() < (1U << 30) ? bytes.size() : 1U << 30;
    sum = crc32(sum, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(part));
    bytes.remove_prefix(part);
  }
  return static_cast<std::uint32_t>(sum);
}

}  // namespace sim
