// 1 / sqrt(v) as the vector code computes it (core/simd/vector.h), one value at a time, bit for
// bit.
#pragma once

#include <cmath>
#include <limits>

namespace sim {

// Limit of e^2, e = 1 - v r^2 for the seed r in single precision. Where seeds have all their 24
// bits e is below 2^-22; it is larger, or not a number, where single precision underflows or
// overflows.
inline constexpr double kSeedError = 0x1p-37;

// |d|^2 of a vector, as the vector code sums it.
inline double square_of(double x, double y, double z) {
  return std::fma(z, z, std::fma(y, y, x * x));
}

// 1 / sqrt(v), at most 1 ulp off, for v from about 2^-130 to 2^128; nan where the seed fails.
inline double inverse_sqrt(double v) {
  const double r = 1.0f / std::sqrt(static_cast<float>(v));
  const double e = std::fma(-(v * r), r, 1.0);
  if (!(e * e <= kSeedError)) return std::numeric_limits<double>::quiet_NaN();
  return std::fma(r * e, std::fma(0.375, e, 0.5), r);
}

}  // namespace sim
