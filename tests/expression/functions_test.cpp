// The elementary functions of expressions, against the C library in long double.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "core/expression/machine.h"

using sim::evaluate;
using sim::Op;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::nan("");

// The largest error in units in the last place, at 20000 places in [low, high]: even ones, or for
// low > 0 and `spread` of every order of magnitude, and their negatives.
template <class Exact>
double worst(Op op, double low, double high, Exact exact, bool spread = false) {
  std::mt19937_64 random(7);
  double most = 0;
  for (int i = 0; i < 20000; ++i) {
    const double u = std::generate_canonical<double, 53>(random);
    const double x = spread ? low * std::pow(high / low, u) : low + u * (high - low);
    const auto value = exact(static_cast<long double>(x));
    const double size = std::fabs(static_cast<double>(value));
    if (!std::isfinite(size)) continue;
    const double ulp = std::nextafter(size, kInfinity) - size;
    const double error = std::fabs(static_cast<double>((evaluate(op, x) - value) / ulp));
    most = error <= most ? most : error;
  }
  return most;
}

}  // namespace

TEST_CASE("elementary functions of expressions are accurate to a few last places") {
  const auto exponential = [](long double x) { return std::exp(x); };
  CHECK(worst(Op::kExp, -708, 709.5, exponential) < 1);
  CHECK(worst(Op::kExp, -1, 1, exponential) < 1);
  const auto logarithm = [](long double x) { return std::log(x); };
  CHECK(worst(Op::kLog, 1e-310, 1e308, logarithm, true) < 1);
  CHECK(worst(Op::kLog, 0.5, 2, logarithm) < 1);
  for (const double most : {10.0, 1e5, 9.9e8}) {
    INFO(most);
    CHECK(worst(Op::kSin, -most, most, [](long double x) { return std::sin(x); }) < 1);
    CHECK(worst(Op::kCos, -most, most, [](long double x) { return std::cos(x); }) < 1);
    CHECK(worst(Op::kTan, -most, most, [](long double x) { return std::tan(x); }) < 3);
  }
  CHECK(worst(
            Op::kSin, 1e-300, 1, [](long double x) { return std::sin(x); }, true) < 1);
  CHECK(worst(Op::kSinh, -700, 700, [](long double x) { return std::sinh(x); }) < 4);
  CHECK(worst(
            Op::kSinh, 1e-20, 50, [](long double x) { return std::sinh(x); }, true) < 4);
  CHECK(worst(Op::kCosh, -700, 700, [](long double x) { return std::cosh(x); }) < 4);
  CHECK(worst(Op::kTanh, -30, 30, [](long double x) { return std::tanh(x); }) < 4);
  CHECK(worst(
            Op::kTanh, 1e-20, 2, [](long double x) { return std::tanh(x); }, true) < 4);
  for (double y : {0.3, -1.7, 12.3}) {
    const auto error = [&](double x) {
      const long double exact = std::pow(static_cast<long double>(x), static_cast<long double>(y));
      return std::fabs(static_cast<double>((evaluate(Op::kPower, x, y) - exact) / exact)) /
             std::numeric_limits<double>::epsilon();
    };
    for (double x = 0.01; x < 100; x *= 1.1) CHECK(error(x) < 2 + 2 * std::fabs(y * std::log(x)));
  }
}

TEST_CASE("elementary functions of expressions at the ends of their range") {
  CHECK(evaluate(Op::kExp, 0) == 1);
  CHECK(evaluate(Op::kExp, -kInfinity) == 0);
  CHECK(evaluate(Op::kExp, 710) == kInfinity);
  CHECK(evaluate(Op::kExp, -745) == std::numeric_limits<double>::denorm_min());
  CHECK(evaluate(Op::kLog, 0) == -kInfinity);
  CHECK(evaluate(Op::kLog, kInfinity) == kInfinity);
  CHECK(evaluate(Op::kLog, 1) == 0);
  CHECK(evaluate(Op::kSinh, -800) == -kInfinity);
  CHECK(evaluate(Op::kTanh, -kInfinity) == -1);
  CHECK(evaluate(Op::kPower, 0, 0.3) == 0);
  CHECK(evaluate(Op::kFloor, -1.5) == -2);
  CHECK(evaluate(Op::kFloor, 1e300) == 1e300);
  CHECK(evaluate(Op::kFloor, 4503599627370495.5) == 4503599627370495.0);
  CHECK(evaluate(Op::kStep, 0) == 1);
  CHECK(evaluate(Op::kStep, -1e-300) == 0);
  CHECK(evaluate(Op::kSign, -3) == -1);
  CHECK(evaluate(Op::kSign, 0) == 0);

  // A function without a value gives not-a-number, which propagates.
  CHECK(std::isnan(evaluate(Op::kSqrt, -1)));
  CHECK(std::isnan(evaluate(Op::kLog, -1)));
  CHECK(std::isnan(evaluate(Op::kPower, -1, 0.3)));
  CHECK(std::isnan(evaluate(Op::kSin, 1e9)));
  CHECK(std::isnan(evaluate(Op::kCos, kInfinity)));
  for (int op = static_cast<int>(Op::kCopy); op <= static_cast<int>(Op::kSelect); ++op) {
    INFO(op);
    CHECK(std::isnan(evaluate(static_cast<Op>(op), kNan, 1, 2)));
    if (sim::operand_count(static_cast<Op>(op)) == 2)
      CHECK(std::isnan(evaluate(static_cast<Op>(op), 1, kNan)));
  }
  CHECK(evaluate(Op::kSelect, 0, kNan, 2) == 2);
  CHECK(evaluate(Op::kSelect, -1, 1, kNan) == 1);
}
