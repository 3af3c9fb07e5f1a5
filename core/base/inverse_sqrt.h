// 1 / sqrt(v) as the vector code computes it (core/base/simd.inc), one value at a time, bit for
// bit.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace sim {

// Where a seed in single precision has 20 bits or more: the numbers from 2^-129, which is subnormal
// there, to below 2^127.
inline constexpr double kSeedMin = 0x1p-129, kSeedMax = 0x1p+127;
inline constexpr std::int64_t kSeedMinBits = std::bit_cast<std::int64_t>(kSeedMin);

inline bool in_seed_range(double v) { return v >= kSeedMin && v < kSeedMax; }

inline double inverse_sqrt(double v) {
  const double r = 1.0f / std::sqrt(static_cast<float>(v));
  const double e = 1.0 - v * (r * r);
  return r + (r * e) * (0.5 + 0.375 * e);
}

}  // namespace sim
