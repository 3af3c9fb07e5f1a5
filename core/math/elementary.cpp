#include "core/math/elementary.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/math/double_double.h"
#include "core/math/logarithm.h"

namespace sim::elementary {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

// Below it sin x, tan x, .. are x but for a part of 2^-60.
constexpr double kSmall = 0x1p-30;

constexpr DoubleDouble kHalfPi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
constexpr DoubleDouble kPi = scaled(kHalfPi, 2);
constexpr DoubleDouble kLog2 = {0x1.62e42fefa39efp-1, 0x1.abc9e3b39803fp-56};
constexpr DoubleDouble kPerLog2 = {0x1.71547652b82fep+0, 0x1.777d0ffda0d24p-56};
constexpr DoubleDouble kPerLog10 = {0x1.bcb7b1526e50ep-2, 0x1.95355baaafad3p-57};

double rounded(DoubleDouble x) { return x.high + x.low; }

// --- Exponentials -----------------------------------------------------------------------------

// 2^(j/64), by the series of e^x.
constexpr int kPowers = 64;
constexpr std::array<DoubleDouble, kPowers> kPowersOf2 = [] {
  std::array<DoubleDouble, kPowers> table{};
  for (int j = 0; j < kPowers; ++j) {
    const DoubleDouble x = scaled(kLog2 * static_cast<double>(j), 1.0 / kPowers);
    DoubleDouble sum{1, 0};
    for (int n = 28; n >= 1; --n) sum = x * sum / DoubleDouble{static_cast<double>(n), 0} + 1.0;
    table[static_cast<std::size_t>(j)] = sum;
  }
  return table;
}();

// e^x = 2^exponent power (1 + rest).
struct Exponential {
  int exponent = 0;
  DoubleDouble power, rest;

  DoubleDouble mantissa() const { return power + power * rest; }
};

// For |x| < 800. With x = (n/64) log 2 + r, |r| < 0.0055: n log 2 is taken off in parts (Cody &
// Waite 1980), the first exactly; rest = e^r - 1 by its series, of which two terms need more than a
// double.
Exponential exponential(DoubleDouble x) {
  constexpr double kPart1 = 0x1.62e42fef8p-7, kPart2 = 0x1.1cf79abc9e3b4p-42;  // log 2 / 64
  constexpr double kPart3 = -0x1.9ff0342542fc3p-96;
  const double n = std::floor(x.high * 0x1.71547652b82fep+6 + 0.5);
  const DoubleDouble second = exact_product(n, kPart2);
  const DoubleDouble r =
      exact_sum(x.high - n * kPart1, -second.high) + (x.low - second.low - n * kPart3);

  const double z = r.high;
  const double tail =
      z * z * z * (1 / 6.0 + z * (1 / 24.0 + z * (1 / 120.0 + z * (1 / 720.0 + z / 5040.0))));
  const DoubleDouble square = exact_product(z, z) + 2 * z * r.low;
  const DoubleDouble rest = r + (scaled(square, 0.5) + tail);

  const int whole = static_cast<int>(n), j = whole & (kPowers - 1);
  return {(whole - j) / kPowers, kPowersOf2[static_cast<std::size_t>(j)], rest};
}

double with_exponent(DoubleDouble mantissa, int exponent) {
  return std::ldexp(rounded(mantissa), exponent);
}

// e^x - 1 for |x| < 45.
DoubleDouble exponential_less_one(double x) {
  const Exponential e = exponential({x, 0});
  if (e.exponent == 0 && e.power.high == 1) return e.rest;
  return scaled(e.mantissa(), std::ldexp(1.0, e.exponent)) + -1.0;
}

// e^x, for any x.
double exponential_of(DoubleDouble x) {
  if (x.high > 710) return kInfinity;
  if (x.high < -746) return 0;
  const Exponential e = exponential(x);
  return with_exponent(e.mantissa(), e.exponent);
}

// --- Logarithms -------------------------------------------------------------------------------

// For finite x > 0. x = 2^e m with m from sqrt(1/2) to sqrt(2), and an approximation y of log m;
// then log m = y + log(1 + t), t = m e^-y - 1.
DoubleDouble logarithm_of(double x) {
  const auto [e, m] = near_one(x);
  const double y = logarithm_near_one(m, 19);  // to some 1e-16

  const Exponential less = exponential({-y, 0});
  const DoubleDouble near = scaled(less.power * m, std::ldexp(1.0, less.exponent));
  const DoubleDouble t = (near + -1.0) + near * less.rest;
  const DoubleDouble log_m = DoubleDouble{y, 0} + (t + -0.5 * t.high * t.high);
  // e times the first part, of 42 bits, is exact.
  constexpr double kPart1 = 0x1.62e42fefa38p-1, kPart2 = 0x1.ef35793c7673p-45;
  return DoubleDouble{e * kPart1, 0} + (exact_product(e, kPart2) + log_m);
}

// A logarithm in another base, whose natural one is 1 / per.
double logarithm_in(double x, DoubleDouble per) {
  if (std::isnan(x) || x < 0) return kNotANumber;
  if (x == 0) return -kInfinity;
  return x == kInfinity ? x : rounded(logarithm_of(x) * per);
}

// --- Sine and cosine --------------------------------------------------------------------------

// sin(i/32) and cos(i/32), by their series, for angles to pi/2.
struct SineCosine {
  DoubleDouble sine, cosine;
};
constexpr int kAngles = 32;
constexpr std::array<SineCosine, 52> kSines = [] {
  std::array<SineCosine, 52> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double x = static_cast<double>(i) / kAngles;
    const DoubleDouble square = exact_product(x, x);
    DoubleDouble sine{1, 0}, cosine{1, 0};
    for (double n = 31; n >= 1; n -= 2) {
      cosine = -(square * cosine / DoubleDouble{n * (n + 1), 0}) + 1.0;
      sine = -(square * sine / DoubleDouble{(n + 1) * (n + 2), 0}) + 1.0;
    }
    table[i] = {sine * x, cosine};
  }
  return table;
}();

// Sine and cosine of a + b, |a + b| <= 1.6, by those of a = i/32 and the series of b.
SineCosine sine_cosine(DoubleDouble angle) {
  if (angle.high < 0) {
    const SineCosine mirrored = sine_cosine(-angle);
    return {-mirrored.sine, mirrored.cosine};
  }
  const double i = std::floor(angle.high * kAngles + 0.5);
  const SineCosine& a = kSines[static_cast<std::size_t>(i)];
  const DoubleDouble b = exact_sum(angle.high - i / kAngles, angle.low);
  const DoubleDouble square = exact_product(b.high, b.high) + 2 * b.high * b.low;
  const double z = square.high;
  // sin b and cos b - 1; only their first terms need more than a double.
  const DoubleDouble sine =
      b + b.high * z * (-1 / 6.0 + z * (1 / 120.0 + z * (-1 / 5040.0 + z / 362880.0)));
  const DoubleDouble less =
      scaled(square, -0.5) + z * z * (1 / 24.0 + z * (-1 / 720.0 + z / 40320.0));
  if (i == 0) return {sine, less + 1.0};
  return {a.sine + (a.sine * less + a.cosine * sine), a.cosine + (a.cosine * less - a.sine * sine)};
}

// 2/pi in binary, behind 64 zeros: 32 bits a word.
constexpr std::uint32_t kTwoPerPi[] = {
    0,          0,          0xa2f9836e, 0x4e441529, 0xfc2757d1, 0xf534ddc0, 0xdb629599, 0x3c439041,
    0xfe5163ab, 0xdebbc561, 0xb7246e3a, 0x424dd2e0, 0x06492eea, 0x09d1921c, 0xfe1deb1c, 0xb129a73e,
    0xe88235f5, 0x2ebb4484, 0xe99c7026, 0xb45f7e41, 0x3991d639, 0x835339f4, 0x9c845f8b, 0xbdf9283b,
    0x1ff897ff, 0xde05980f, 0xef2f118b, 0x5a0a6d1f, 0x6d367ecf, 0x27cb09b7, 0x4f463f66, 0x9e5fea2d,
    0x7527bac7, 0xebe5f17b, 0x3d0739f7, 0x8a5292ea, 0x6bfb5fb1, 0x1f8d5d08, 0x56033046, 0xfc7b6bab};

// x = quarter pi/2 + angle, |angle| <= pi/4, up to a multiple of 2 pi.
struct Reduced {
  int quarter = 0;
  DoubleDouble angle;
};

// Argument reduction for finite x. x = +- m 2^e with whole m < 2^53. In m 2^e 2/pi only the part
// below 4 matters: m times 192 bits of 2/pi, from that on whose products are below 4 (Payne & Hanek
// 1983). No double is closer to a multiple of pi/2 than 2^-62 of itself, so that at least 70 bits
// of the angle are right.
Reduced reduced(double x) {
  if (std::fabs(x) <= 0.78) return {0, {x, 0}};
  int e = 0;
  const auto m = static_cast<std::uint64_t>(std::ldexp(std::frexp(std::fabs(x), &e), 53));
  e -= 53;
  constexpr int kLimbs = 6;
  const int begin = 64 + e - 2, word = begin / 32, shift = begin % 32;
  std::uint64_t limbs[kLimbs];  // of the product modulo 2^192, the highest first
  std::uint64_t carry = 0;
  const std::uint64_t low = m & 0xffffffff, high = m >> 32;
  std::uint64_t below = 0;  // the limb of 2/pi one place lower
  for (int i = kLimbs - 1; i >= 0; --i) {
    const std::uint64_t pair = std::uint64_t{kTwoPerPi[word + i]} << 32 | kTwoPerPi[word + i + 1];
    const std::uint64_t bits = pair >> (32 - shift) & 0xffffffff;
    const std::uint64_t first = low * bits, second = high * below;
    const std::uint64_t sum = (first & 0xffffffff) + (second & 0xffffffff) + carry;
    limbs[i] = sum & 0xffffffff;
    carry = (sum >> 32) + (first >> 32) + (second >> 32);
    below = bits;
  }
  // Two bits before the point, 190 behind it; the nearest whole number is taken off.
  int quarter = static_cast<int>(limbs[0] >> 30);
  const bool negative = (limbs[0] >> 29 & 1) != 0;
  limbs[0] &= 0x3fffffff;
  if (negative) {
    quarter = (quarter + 1) & 3;
    std::uint64_t borrow = 1;  // 2^190 less the fraction
    for (int i = kLimbs - 1; i >= 0; --i) {
      const std::uint64_t flipped = (limbs[i] ^ 0xffffffff) + borrow;
      limbs[i] = flipped & 0xffffffff;
      borrow = flipped >> 32;
    }
    limbs[0] &= 0x3fffffff;
  }
  DoubleDouble turns;
  double unit = 0x1p-30;
  for (const std::uint64_t limb : limbs) {
    turns = turns + static_cast<double>(limb) * unit;
    unit *= 0x1p-32;
  }
  DoubleDouble angle = kHalfPi * turns;
  if (negative) angle = -angle;
  if (x < 0) return {-quarter & 3, -angle};
  return {quarter, angle};
}

// Sine and cosine of any finite number.
SineCosine sine_cosine_of(double x) {
  const Reduced part = reduced(x);
  const SineCosine near = sine_cosine(part.angle);
  switch (part.quarter) {
    case 1:
      return {near.cosine, -near.sine};
    case 2:
      return {-near.sine, -near.cosine};
    case 3:
      return {-near.cosine, near.sine};
    default:
      return near;
  }
}

// --- Angles -----------------------------------------------------------------------------------

// The angle of a point with x >= 0 and y >= 0, not both 0 and neither far from 1 by more than 2^70.
// From a near angle a0 on: a0 + arctan((y cos a0 - x sin a0) / (x cos a0 + y sin a0)).
DoubleDouble angle_of(DoubleDouble y, DoubleDouble x) {
  // arctan t to 2e-8 (Abramowitz & Stegun 1964, 4.4.49).
  constexpr double kTerms[] = {0.0028662257, -0.0161657367, 0.0429096138, -0.0752896400,
                               0.1065626393, -0.1420889944, 0.1999355085, -0.3333314528};
  const bool steep = y.high > x.high;
  const double t = steep ? x.high / y.high : y.high / x.high;
  double sum = 0;
  for (const double term : kTerms) sum = (sum + term) * t * t;
  const double flat = t + t * sum, near = steep ? kHalfPi.high - flat : flat;

  const SineCosine at = sine_cosine({near, 0});
  const DoubleDouble off = (y * at.cosine - x * at.sine) / (x * at.cosine + y * at.sine);
  return off + near;
}

}  // namespace

double sin(double x) {
  if (!std::isfinite(x)) return kNotANumber;
  return x == 0 ? x : rounded(sine_cosine_of(x).sine);
}

double cos(double x) { return std::isfinite(x) ? rounded(sine_cosine_of(x).cosine) : kNotANumber; }

double tan(double x) {
  if (!std::isfinite(x)) return kNotANumber;
  if (std::fabs(x) < kSmall) return x;
  const SineCosine both = sine_cosine_of(x);
  return rounded(both.sine / both.cosine);
}

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return kNotANumber;
  const double up = std::fabs(y), along = std::fabs(x);
  const bool back = std::signbit(x);
  DoubleDouble angle;
  int exponent_up = 0, exponent_along = 0;
  if (up == 0) {
    angle = {};
  } else if (along == 0) {
    angle = kHalfPi;
  } else if (up == kInfinity || along == kInfinity) {
    angle = up != along ? (up == kInfinity ? kHalfPi : DoubleDouble{}) : scaled(kHalfPi, 0.5);
  } else {
    const double m = std::frexp(up, &exponent_up), n = std::frexp(along, &exponent_along);
    const int apart = exponent_up - exponent_along;
    // The ratio itself, or less than the last bit of a right angle.
    if (apart < -60 && !back) return std::copysign(up / along, y);
    if (apart > 60)
      angle = kHalfPi;
    else if (apart < -60)
      angle = {};
    else
      angle = angle_of({std::ldexp(m, apart), 0}, {n, 0});
  }
  if (back) angle = kPi - angle;
  return std::copysign(rounded(angle), y);
}

double asin(double x) {
  const double size = std::fabs(x);
  if (!(size <= 1)) return kNotANumber;
  if (size < kSmall) return x;
  const DoubleDouble across = root_of(-exact_product(size, size) + 1.0);
  return std::copysign(rounded(angle_of({size, 0}, across)), x);
}

double acos(double x) {
  const double size = std::fabs(x);
  if (!(size <= 1)) return kNotANumber;
  if (size < 0x1p-60) return kHalfPi.high;
  const DoubleDouble up = root_of(-exact_product(size, size) + 1.0);
  const DoubleDouble angle = angle_of(up, {size, 0});
  return rounded(x < 0 ? kPi - angle : angle);
}

double exp(double x) { return std::isnan(x) ? x : exponential_of({x, 0}); }

double log(double x) { return logarithm_in(x, {1, 0}); }

double log2(double x) { return logarithm_in(x, kPerLog2); }

double log10(double x) { return logarithm_in(x, kPerLog10); }

double pow(double x, double y) {
  if (y == 0 || x == 1) return 1;
  if (std::isnan(x) || std::isnan(y)) return kNotANumber;
  const double size = std::fabs(x);
  if (std::isinf(y)) return size == 1 ? 1 : ((size > 1) == (y > 0) ? kInfinity : 0);
  const bool whole = y == std::floor(y), odd = whole && std::fmod(y, 2) != 0;
  const double sign = odd && std::signbit(x) ? -1 : 1;
  if (size == 0 || size == kInfinity) return sign * ((size == 0) == (y < 0) ? kInfinity : 0);
  if (x < 0 && !whole) return kNotANumber;
  const DoubleDouble log = logarithm_of(size);
  // Far beyond the largest number or below the smallest, where the product may overflow.
  const double about = log.high * y;
  if (!(std::fabs(about) < 800)) return sign * (about > 0 ? kInfinity : 0);
  return sign * exponential_of(log * y);
}

double sinh(double x) {
  const double size = std::fabs(x);
  if (std::isnan(x) || size < kSmall) return x;
  if (size >= 800) return std::copysign(kInfinity, x);
  if (size >= 40) {
    const Exponential e = exponential({size, 0});
    return std::copysign(with_exponent(e.mantissa(), e.exponent - 1), x);
  }
  const DoubleDouble p = exponential_less_one(size);
  return std::copysign(rounded(scaled(p + p / (p + 1.0), 0.5)), x);
}

double cosh(double x) {
  const double size = std::fabs(x);
  if (!(size < 800)) return std::isnan(x) ? x : kInfinity;
  const Exponential e = exponential({size, 0});
  if (size >= 40) return with_exponent(e.mantissa(), e.exponent - 1);
  const DoubleDouble power = scaled(e.mantissa(), std::ldexp(1.0, e.exponent));
  return rounded(scaled(power + DoubleDouble{1, 0} / power, 0.5));
}

double tanh(double x) {
  const double size = std::fabs(x);
  if (std::isnan(x) || size < kSmall) return x;
  if (size >= 20) return std::copysign(1.0, x);
  const DoubleDouble p = exponential_less_one(2 * size);
  return std::copysign(rounded(p / (p + 2.0)), x);
}

}  // namespace sim::elementary
