#include "core/base/input_file.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>

#include "core/base/hash.h"

namespace sim {

std::uint64_t content_hash(std::string_view bytes) {
  StateHash hash;
  hash.add(static_cast<std::uint64_t>(bytes.size()));
  for (; !bytes.empty(); bytes.remove_prefix(std::min<std::size_t>(8, bytes.size()))) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), std::min<std::size_t>(8, bytes.size()));
    hash.add(word);
  }
  return hash.value() == 0 ? 1 : hash.value();
}

std::uint64_t content_hash_of(const std::filesystem::path& file) {
  std::error_code failed;
  if (!std::filesystem::is_regular_file(file, failed)) return 0;  // a pipe has no end
  std::ifstream in(file, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(in), {});
  return in.is_open() && !in.bad() ? content_hash(bytes) : 0;
}

}  // namespace sim
