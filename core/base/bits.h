// A bit for each particle, bit i % 8 of byte i / 8.
#pragma once

#include <cstdint>

namespace sim {

inline bool bit(const std::uint8_t* bits, std::int64_t i) { return bits[i >> 3] >> (i & 7) & 1; }

inline void set_bit(std::uint8_t* bits, std::int64_t i) {
  bits[i >> 3] |= static_cast<std::uint8_t>(1u << (i & 7));
}

}  // namespace sim
