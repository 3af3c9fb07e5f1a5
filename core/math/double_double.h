// Numbers as sums of two doubles, some 106 bits, from sums and products alone: the same bits on
// every machine that rounds as IEEE 754 says and contracts nothing. No fused operation is used:
// without an instruction for it that would be slow. Source: Dekker (1971), A floating-point
// technique for extending the available precision; Knuth, The Art of Computer Programming 2,
// section 4.2.2.
#pragma once

#include <cmath>

namespace sim {

// high + low, |low| at most half an ulp of high.
struct DoubleDouble {
  double high = 0, low = 0;
};

// a + b exactly; |a| >= |b|, or a = 0.
constexpr DoubleDouble ordered_sum(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

// a + b exactly (Knuth).
constexpr DoubleDouble exact_sum(double a, double b) {
  const double sum = a + b, b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

// a b exactly, for |a| and |b| below 2^995 and a product that is not near the subnormal numbers
// (Dekker): halves of 26 bits.
constexpr DoubleDouble exact_product(double a, double b) {
  constexpr double kSplit = 0x1p27 + 1;
  const double a_scaled = kSplit * a, a_high = a_scaled - (a_scaled - a), a_low = a - a_high;
  const double b_scaled = kSplit * b, b_high = b_scaled - (b_scaled - b), b_low = b - b_high;
  const double product = a * b;
  return {product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low};
}

constexpr DoubleDouble operator-(DoubleDouble a) { return {-a.high, -a.low}; }

constexpr DoubleDouble operator+(DoubleDouble a, double b) {
  const DoubleDouble sum = exact_sum(a.high, b);
  return ordered_sum(sum.high, sum.low + a.low);
}

constexpr DoubleDouble operator+(DoubleDouble a, DoubleDouble b) {
  const DoubleDouble high = exact_sum(a.high, b.high), low = exact_sum(a.low, b.low);
  const DoubleDouble sum = ordered_sum(high.high, high.low + low.high);
  return ordered_sum(sum.high, sum.low + low.low);
}

constexpr DoubleDouble operator-(DoubleDouble a, DoubleDouble b) { return a + -b; }

constexpr DoubleDouble operator*(DoubleDouble a, double b) {
  const DoubleDouble product = exact_product(a.high, b);
  return ordered_sum(product.high, product.low + a.low * b);
}

constexpr DoubleDouble operator*(DoubleDouble a, DoubleDouble b) {
  const DoubleDouble product = exact_product(a.high, b.high);
  return ordered_sum(product.high, product.low + (a.high * b.low + a.low * b.high));
}

constexpr DoubleDouble operator/(DoubleDouble a, DoubleDouble b) {
  const double first = a.high / b.high;
  const DoubleDouble rest = a - b * first;
  const double second = rest.high / b.high;
  return ordered_sum(first, second);
}

// For a power of two, exactly.
constexpr DoubleDouble scaled(DoubleDouble a, double power_of_two) {
  return {a.high * power_of_two, a.low * power_of_two};
}

// The square root of a >= 0 by one step of Newton.
inline DoubleDouble root_of(DoubleDouble a) {
  const double root = std::sqrt(a.high);
  if (root == 0) return {};
  return ordered_sum(root, (a - exact_product(root, root)).high / (2 * root));
}

}  // namespace sim
