// x^y from sums and products alone, so that it has the same bits on every machine.
#pragma once

#include <cmath>

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

// x^y from log x.
inline double power_from_log(double log, double y) { return damping(1, -y * log).keep; }

// For finite x > 0 and |y log x| < 700; relative error some 1e-15 times 1 + |y log x|.
inline double power(double x, double y) { return power_from_log(log_for_power(x), y); }

}  // namespace sim
