// The natural logarithm from sums, products and quotients alone, so that it has the same bits on
// every machine.
#pragma once

#include <cmath>

namespace sim {

// x = 2^exponent m with m in [1/sqrt(2), sqrt(2)), for finite x > 0.
struct NearOne {
  int exponent = 0;
  double m = 1;
};
inline NearOne near_one(double x) {
  NearOne result;
  result.m = std::frexp(x, &result.exponent);
  if (result.m < 0.70710678118654752) {
    result.m *= 2;
    --result.exponent;
  }
  return result;
}

// log m = 2 artanh(s), s = (m - 1) / (m + 1), by its series up to s^power, an odd one. For m near
// one |s| < 0.172: with a power of 21 the first term left out is below 1e-18.
inline double logarithm_near_one(double m, int power) {
  const double s = (m - 1) / (m + 1), q = s * s;
  double sum = 0;
  for (int k = power; k >= 3; k -= 2) sum = (sum + 1.0 / k) * q;
  return 2 * (s + s * sum);
}

// For finite x > 0; relative error some 1e-16 away from 1, absolute near it.
inline double logarithm(double x) {
  const NearOne near = near_one(x);
  return near.exponent * 0.69314718055994531 + logarithm_near_one(near.m, 21);
}

}  // namespace sim
