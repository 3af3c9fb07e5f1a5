// Elementary functions of our own: how close they are to the true values, and what they give at the
// ends of their domains.
#include <catch2/catch.hpp>
#include <cfloat>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "core/math/elementary.h"

namespace {

using namespace sim;

using Function = double (*)(double);

// Units in the last place of `value` between a result and what it should be.
double ulps(double found, long double value) {
  int exponent = 0;
  static_cast<void>(std::frexp(static_cast<double>(value), &exponent));
  const long double unit = std::ldexp(1.0L, std::max(exponent, -1021) - 53);
  return static_cast<double>(std::fabs(found - value) / unit);
}

bool same(double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
  return a == b && std::signbit(a) == std::signbit(b);
}

class Random {
 public:
  double uniform(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(generator_);
  }
  // A number of either sign, its size from 2^least to 2^most.
  double of_any_size(double least, double most) {
    const double size = std::exp2(uniform(least, most));
    return generator_() % 2 == 0 ? size : -size;
  }

 private:
  std::mt19937_64 generator_{1};
};

// Long doubles know 11 bits more: their functions are a reference to 1/1000 ulp.
constexpr bool kHasReference = LDBL_MANT_DIG >= 64;

}  // namespace

TEST_CASE("elementary functions are half an ulp off at most") {
  if (!kHasReference) return;
  struct Case {
    const char* name;
    Function function;
    long double (*reference)(long double);
    std::function<double(Random&, int)> argument;
  };
  const auto angle = [](Random& random, int i) {
    return i % 3 == 0 ? random.uniform(-10, 10) : random.of_any_size(-40, i % 3 == 1 ? 20 : 60);
  };
  const auto fraction = [](Random& random, int i) {
    return i % 3 == 0   ? random.uniform(-1, 1)
           : i % 3 == 1 ? random.of_any_size(-60, 0)
                        : 1 - std::fabs(random.of_any_size(-52, -1));
  };
  const auto power = [](Random& random, int i) {
    return i % 3 == 0   ? random.uniform(-700, 700)
           : i % 3 == 1 ? random.uniform(-2, 2)
                        : random.of_any_size(-60, 9);
  };
  const auto positive = [](Random& random, int i) {
    return i % 3 == 0   ? random.uniform(1e-3, 10)
           : i % 3 == 1 ? 1 + random.of_any_size(-52, -1)
                        : std::fabs(random.of_any_size(-1074, 1023));
  };
  const Case cases[] = {{"sin", elementary::sin, std::sin, angle},
                        {"cos", elementary::cos, std::cos, angle},
                        {"tan", elementary::tan, std::tan, angle},
                        {"asin", elementary::asin, std::asin, fraction},
                        {"acos", elementary::acos, std::acos, fraction},
                        {"exp", elementary::exp, std::exp, power},
                        {"log", elementary::log, std::log, positive},
                        {"log2", elementary::log2, std::log2, positive},
                        {"log10", elementary::log10, std::log10, positive},
                        {"sinh", elementary::sinh, std::sinh, power},
                        {"cosh", elementary::cosh, std::cosh, power},
                        {"tanh", elementary::tanh, std::tanh, power}};
  for (const Case& each : cases) {
    Random random;
    double worst = 0, at = 0;
    for (int i = 0; i < 30000; ++i) {
      const double x = each.argument(random, i);
      const double off = ulps(each.function(x), each.reference(x));
      if (off > worst) worst = off, at = x;
    }
    CAPTURE(each.name, at);
    // The library's own long functions are a few of their ulps off, 2^-11 of ours each.
    CHECK(worst <= 0.502);
  }
}

TEST_CASE("powers and angles of two numbers are half an ulp off at most") {
  if (!kHasReference) return;
  Random random;
  double worst_power = 0, worst_angle = 0;
  for (int i = 0; i < 60000; ++i) {
    const double x =
        std::fabs(i % 2 == 0 ? random.of_any_size(-3, 3) : random.of_any_size(-900, 900));
    const double y = i % 3 == 0 ? random.of_any_size(-20, 40) : random.uniform(-10, 10);
    const long double power = std::pow(static_cast<long double>(x), static_cast<long double>(y));
    if (power > DBL_MIN && power < DBL_MAX)
      worst_power = std::max(worst_power, ulps(elementary::pow(x, y), power));
    const long double angle = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
    if (std::fabs(angle) > DBL_MIN)
      worst_angle = std::max(worst_angle, ulps(elementary::atan2(y, x), angle));
    const long double behind =
        std::atan2(static_cast<long double>(y), -static_cast<long double>(x));
    worst_angle = std::max(worst_angle, ulps(elementary::atan2(y, -x), behind));
  }
  CHECK(worst_power <= 0.502);
  CHECK(worst_angle <= 0.502);
}

// The hardest argument of 53 bits for the reduction (Muller, Elementary Functions, 3rd edition,
// section 11.2): 6381956970095103 * 2^797 is 2^-60.9 of a quarter turn away from a whole number of
// them.
TEST_CASE("sines of huge numbers are right") {
  const double hardest = std::ldexp(6381956970095103.0, 797);
  CHECK(elementary::cos(hardest) == -4.687165924254628e-19);
  CHECK(elementary::sin(hardest) == 1);
  CHECK(elementary::sin(1e22) == -0.8522008497671888);
  CHECK(elementary::cos(1e22) == 0.523214785395139);
  CHECK(elementary::sin(std::numeric_limits<double>::max()) == 0.004961954789184062);
}

TEST_CASE("results that are numbers are exact") {
  for (int n = 0; n <= 22; ++n) CHECK(elementary::log10(elementary::pow(10, n)) == n);
  for (int n = -1074; n <= 1023; ++n) {
    CHECK(elementary::pow(2, n) == std::ldexp(1.0, n));
    CHECK(elementary::log2(std::ldexp(1.0, n)) == n);
  }
  CHECK(elementary::pow(-3, 3) == -27);
  CHECK(elementary::pow(27, 1.0 / 3) == 3);
  CHECK(elementary::pow(2.25, -1.5) == 8 / 27.0);
  CHECK(elementary::exp(0) == 1);
  CHECK(elementary::log(1) == 0);
  CHECK(elementary::atan2(1, 1) == std::atan(1.0));
}

// C99, annex F.
TEST_CASE("special arguments give what the C library gives") {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<double> numbers = {0.0,       0.5,          1,      2,    3,          1e300,
                                       kInfinity, std::nan(""), 5e-324, 1e17, 0x1p52 + 1, 1e-310};
  std::vector<double> special = numbers;
  for (const double number : numbers) special.push_back(-number);
  const std::pair<Function, Function> functions[] = {
      {elementary::sin, std::sin},   {elementary::cos, std::cos},   {elementary::tan, std::tan},
      {elementary::asin, std::asin}, {elementary::acos, std::acos}, {elementary::exp, std::exp},
      {elementary::log, std::log},   {elementary::log2, std::log2}, {elementary::log10, std::log10},
      {elementary::sinh, std::sinh}, {elementary::cosh, std::cosh}, {elementary::tanh, std::tanh}};
  for (const double x : special) {
    for (const auto& [own, reference] : functions) {
      const double found = own(x), expected = reference(x);
      CAPTURE(x, found, expected);
      // An ordinary value may differ from the C library's in the last bit.
      CHECK((same(found, expected) || (std::isnormal(expected) && ulps(found, expected) <= 2)));
    }
    for (const double y : special) {
      CAPTURE(x, y);
      CHECK(same(elementary::pow(x, y), std::pow(x, y)));
      CHECK(same(elementary::atan2(x, y), std::atan2(x, y)));
    }
  }
}
