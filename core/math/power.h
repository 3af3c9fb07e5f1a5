// x^y from sums and products alone, so that it has the same bits on every machine.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "core/math/exponential.h"

namespace sim {

// log x for finite x > 0, as power() takes it.
inline double log_for_power(double x) {
  // x = m 2^e with m in [1/2, 1), log m = 2 atanh(s), s = (m - 1) / (m + 1), |s| <= 1/3.
  int exponent = 0;
  const double m = std::frexp(x, &exponent);
  const double s = (m - 1) / (m + 1), square = s * s;
  double series = 0;
#pragma GCC unroll 18  // the quotients are constants then
  for (int n = 35; n >= 1; n -= 2) series = series * square + 1.0 / n;
  constexpr double kLog2 = 0.69314718055994530942;
  return exponent * kLog2 + 2 * s * series;
}

// For finite x > 0 and |y log x| < 700; relative error some 1e-15 times 1 + |y log x|.
inline double power(double x, double y) { return damping(1, -y * log_for_power(x)).keep; }

// A logarithm and a power of 2 for decisions, such as how long a step is: a tenth of the time of
// power(). The error of log2 x is below 2e-9 (1 + |log2 x|), that of 2^y below 1e-8 of it. x is
// normal and positive, |y| below 1000.
inline double quick_log2(double x) {
  // x = m 2^e with m from sqrt(1/2) to sqrt(2), log m = 2 atanh(s), s = (m - 1) / (m + 1).
  constexpr std::uint64_t kRootOfHalf = 0x3fe6a09e667f3bcd;  // the bits of sqrt(1/2)
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const std::int64_t exponent = static_cast<std::int64_t>(bits - kRootOfHalf) >> 52;
  const auto m = std::bit_cast<double>(bits - (static_cast<std::uint64_t>(exponent) << 52));
  const double s = (m - 1) / (m + 1), square = s * s, fourth = square * square;
  const double series =
      (1 + square * (1.0 / 3)) + fourth * ((1.0 / 5 + square * (1.0 / 7)) + fourth * (1.0 / 9));
  constexpr double kTwoOverLog2 = 2.88539008177792681472;
  return static_cast<double>(exponent) + kTwoOverLog2 * s * series;
}

inline double quick_exp2(double y) {
  // 2^y = 2^n e^z with |z| <= log(2) / 2: the series of e^z to z^7.
  const auto n = static_cast<std::int64_t>(y + (y < 0 ? -0.5 : 0.5));
  constexpr double kLog2 = 0.69314718055994530942;
  const double z = (y - static_cast<double>(n)) * kLog2, square = z * z;
  const double low = (1 + z) + square * (0.5 + z * (1.0 / 6));
  const double high = (1.0 / 24 + z * (1.0 / 120)) + square * (1.0 / 720 + z * (1.0 / 5040));
  const auto scale = std::bit_cast<double>(static_cast<std::uint64_t>(n + 1023) << 52);
  return scale * (low + square * square * high);
}

}  // namespace sim
