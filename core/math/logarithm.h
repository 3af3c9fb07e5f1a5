// The natural logarithm from sums, products and quotients alone, so that it has the same bits on
// every machine.
#pragma once

#include <cmath>

namespace sim {

// For finite x > 0; relative error some 1e-16 away from 1, absolute near it.
inline double logarithm(double x) {
  // x = 2^e m with m in [1/sqrt(2), sqrt(2)), then log m = 2 artanh(s), s = (m - 1) / (m + 1), by
  // its series: |s| < 0.172, so that the first term left out is below 1e-18.
  int e = 0;
  double m = std::frexp(x, &e);
  if (m < 0.70710678118654752) {
    m *= 2;
    --e;
  }
  const double s = (m - 1) / (m + 1), q = s * s;
  double sum = 0;
  for (int k = 21; k >= 3; k -= 2) sum = (sum + 1.0 / k) * q;
  return e * 0.69314718055994531 + 2 * (s + s * sum);
}

}  // namespace sim
