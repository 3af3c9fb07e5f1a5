#include "core/simd/inverse_sqrt.h"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>

using namespace sim;

namespace {

// Distance of a result from the exact value, in units in the last place.
double ulps(double result, long double exact) {
  const double unit = std::nextafter(result, HUGE_VAL) - result;
  return static_cast<double>(std::fabs(static_cast<long double>(result) - exact) / unit);
}

// Any mantissa, with a binary exponent from [lowest, lowest + 256).
double random_value(std::uint64_t& state, int lowest) {
  state = state * 6364136223846793005u + 1442695040888963407u;
  const std::uint64_t exponent = static_cast<std::uint64_t>(1023 + lowest) + (state >> 56);
  return std::bit_cast<double>((exponent << 52) | (state & 0xfffffffffffffu));
}

}  // namespace

TEST_CASE("the inverse square root is at most one ulp off wherever it gives a number") {
  std::uint64_t state = 1;
  double worst = 0;
  int numbers = 0;
  for (int i = 0; i < 400000; ++i) {
    const double v = random_value(state, -150);
    const double result = inverse_sqrt(v);
    if (std::isnan(result)) continue;
    ++numbers;
    worst = std::max(worst, ulps(result, 1 / std::sqrt(static_cast<long double>(v))));
  }
  CHECK(worst <= 1.0);
  CHECK(worst > 0.5);  // the measure itself works: no rounding is perfect that often
  CHECK(numbers > 350000);
}

TEST_CASE("the inverse square root gives a number from 2^-126 to below 2^128") {
  for (int e = -126; e < 128; ++e) CHECK_FALSE(std::isnan(inverse_sqrt(std::ldexp(1.0, e))));
  for (const double v : {0.0, 0x1p-1074, 0x1p-152, 0x1p+128, 1e300, HUGE_VAL, std::nan("")})
    CHECK(std::isnan(inverse_sqrt(v)));
}

TEST_CASE("the inverse square root is exact for powers of four") {
  for (int e = -126; e < 127; e += 2)
    CHECK(inverse_sqrt(std::ldexp(1.0, e)) == std::ldexp(1.0, -e / 2));
}
