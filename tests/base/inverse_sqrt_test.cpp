#include "core/base/inverse_sqrt.h"

#include <catch2/catch.hpp>

#include <bit>
#include <cmath>
#include <cstdint>

using namespace sim;

namespace {

// Distance of a result from the exact value, in units in the last place.
double ulps(double result, long double exact) {
  const double unit = std::nextafter(result, HUGE_VAL) - result;
  return static_cast<double>(std::fabs(static_cast<long double>(result) - exact) / unit);
}

}  // namespace

TEST_CASE("the inverse square root is at most one ulp off in its whole range", "[base]") {
  std::uint64_t random = 1;
  double worst = 0;
  for (int i = 0; i < 400000; ++i) {
    random = random * 6364136223846793005u + 1442695040888963407u;
    // Any mantissa, any exponent of the range 2^-129 .. 2^127.
    const std::uint64_t exponent = 1023 - 129 + (random >> 56);
    const double v = std::bit_cast<double>((exponent << 52) | (random & 0xfffffffffffffu));
    REQUIRE(in_seed_range(v));
    worst = std::max(worst, ulps(inverse_sqrt(v), 1 / std::sqrt(static_cast<long double>(v))));
  }
  CHECK(worst <= 1.0);
  CHECK(worst > 0.5);  // the measure itself works: no rounding is perfect that often
}

TEST_CASE("the inverse square root is exact for powers of four", "[base]") {
  for (int e = -128; e < 127; e += 2)
    CHECK(inverse_sqrt(std::ldexp(1.0, e)) == std::ldexp(1.0, -e / 2));
}
