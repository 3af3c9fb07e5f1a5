#include "core/base/md5.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace sim {
namespace {

using Words = std::array<std::uint32_t, 4>;

// floor(2^32 |sin(i + 1)|), as the text defines them; the library's sine is good to far more
// digits.
std::array<std::uint32_t, 64> sines() {
  std::array<std::uint32_t, 64> table{};
  for (std::size_t i = 0; i < 64; ++i)
    table[i] = static_cast<std::uint32_t>(
        std::floor(0x1p32 * std::fabs(std::sin(static_cast<double>(i + 1)))));
  return table;
}

void take_block(const char* block, const std::array<std::uint32_t, 64>& table, Words& sum) {
  constexpr int kTurns[4][4] = {{7, 12, 17, 22}, {5, 9, 14, 20}, {4, 11, 16, 23}, {6, 10, 15, 21}};
  constexpr unsigned kStride[4] = {1, 5, 3, 7}, kFirst[4] = {0, 1, 5, 0};
  std::uint32_t word[16];
  std::memcpy(word, block, sizeof word);
  auto [a, b, c, d] = sum;
  for (unsigned i = 0; i < 64; ++i) {
    const unsigned round = i / 16;
    const std::uint32_t mixed = round == 0   ? (b & c) | (~b & d)
                                : round == 1 ? (d & b) | (~d & c)
                                : round == 2 ? b ^ c ^ d
                                             : c ^ (b | ~d);
    const std::uint32_t added =
        a + mixed + table[i] + word[(kStride[round] * i + kFirst[round]) % 16];
    a = d;
    d = c;
    c = b;
    b += std::rotl(added, kTurns[round][i % 4]);
  }
  sum[0] += a;
  sum[1] += b;
  sum[2] += c;
  sum[3] += d;
}

}  // namespace

std::string md5(std::string_view bytes) {
  static_assert(std::endian::native == std::endian::little);
  const auto table = sines();
  Words sum{0x67452301, 0xefcdab89, 0x98badcfe, 0x10325476};
  const std::uint64_t bits = 8 * static_cast<std::uint64_t>(bytes.size());
  for (; bytes.size() >= 64; bytes.remove_prefix(64)) take_block(bytes.data(), table, sum);

  // The rest, a one, zeros, and the length.
  std::string end(bytes);
  end += '\x80';
  end.resize(end.size() <= 56 ? 56 : 120, '\0');
  end.append(reinterpret_cast<const char*>(&bits), 8);
  for (std::size_t at = 0; at < end.size(); at += 64) take_block(end.data() + at, table, sum);

  constexpr std::string_view kHex = "0123456789abcdef";
  unsigned char digest[16];
  std::memcpy(digest, sum.data(), sizeof digest);
  std::string text;
  for (const unsigned char byte : digest) {
    text += kHex[byte >> 4];
    text += kHex[byte & 15];
  }
  return text;
}

}  // namespace sim
