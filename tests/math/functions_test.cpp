// Functions that are computed by sums and products of their own, against those of the C library and
// closed forms.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "core/math/arnoldi.h"
#include "core/math/differences.h"
#include "core/math/exponential.h"
#include "core/math/logarithm.h"
#include "core/math/mat3.h"
#include "core/math/power.h"
#include "core/math/random_spline.h"
#include "core/math/sine.h"
#include "core/math/sparsity.h"

using namespace sim;

namespace {

void near(double found, double expected, double part) {
  CAPTURE(found, expected);
  CHECK(std::fabs(found - expected) <= part * std::fabs(expected));
}

// The quintic B-spline by its truncated powers, (5)! B(s) = sum_j (-1)^j (6 over j) (s - j)_+^5.
double spline(double s) {
  constexpr double kBinomial[] = {1, 6, 15, 20, 15, 6, 1};
  double sum = 0;
  for (int j = 0; j <= 6; ++j)
    if (s > j) sum += (j % 2 == 0 ? 1 : -1) * kBinomial[j] * std::pow(s - j, 5);
  return sum / 120;
}

}  // namespace

TEST_CASE("powers, exponentials, logarithms and waves are those of the C library") {
  constexpr double kPrecision = std::numeric_limits<double>::epsilon();
  for (double x = 1e-30; x < 1e30; x *= 3.7) {
    CAPTURE(x);
    const double expected = std::log(x);
    CHECK(std::fabs(logarithm(x) - expected) <= 2 * kPrecision * (1 + std::fabs(expected)));
    for (const double y : {-1.0 / 9, 0.08, 0.5, -0.7 / 3, 2.0})
      near(power(x, y), std::pow(x, y), 20 * kPrecision * (1 + std::fabs(y * expected)));
  }
  for (double m = 0.5; m < 2; m += 0.003) {
    CAPTURE(m);
    CHECK(std::fabs(logarithm(m) - std::log(m)) <= 2 * kPrecision);
    near(power(m, 0.2), std::pow(m, 0.2), 8 * kPrecision);
  }
  for (double x = -40; x < 40; x += 0.037)
    for (const double gamma : {0.3, -2.0}) {
      CAPTURE(x, gamma);
      const Damping found = damping(gamma, x / gamma);
      near(found.keep, std::exp(-x), 20 * kPrecision * (1 + std::fabs(x)));
      near(found.gain, -std::expm1(-x) / gamma, 20 * kPrecision * (1 + std::fabs(x)));
    }
  CHECK(damping(0, 3).keep == 1);
  CHECK(damping(0, 3).gain == 3);
  for (double turns = -3; turns < 3; turns += 1.0 / 256) {
    CAPTURE(turns);
    const SineCosine found = sine_cosine(turns);
    const double angle = 2 * M_PI * (turns - std::round(turns));
    CHECK(std::fabs(found.sine - std::sin(angle)) <= 3 * kPrecision);
    CHECK(std::fabs(found.cosine - std::cos(angle)) <= 3 * kPrecision);
  }
}

TEST_CASE("quick logarithms and powers are as good as they say, from end to end") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> exponent(-1000, 1000), near_one(0.3, 3);
  for (int n = 0; n < 20000; ++n) {
    const double y = n % 2 ? exponent(random) : exponent(random) / 500;
    const double expected = std::exp2(y);
    CHECK(std::fabs(quick_exp2(y) / expected - 1) < 1e-8);
    for (const double x : {expected, near_one(random)}) {
      const double log = std::log2(x);
      CHECK(std::fabs(quick_log2(x) - log) < 2e-9 * (1 + std::fabs(log)));
    }
  }
  // The ends of the ranges of both series.
  for (const double x : {std::sqrt(0.5), std::sqrt(2.0), 1.0, 2.0, 1e-300, 1e300})
    for (const double beside : {std::nextafter(x, 0), x, std::nextafter(x, HUGE_VAL)})
      CHECK(quick_log2(beside) == Approx(std::log2(beside)).margin(2e-9).epsilon(2e-9));
  for (const double y : {-999.0, -1.5, -0.5, 0.0, 0.5, 1.5, 999.0})
    for (const double beside : {std::nextafter(y, -HUGE_VAL), y, std::nextafter(y, HUGE_VAL)})
      CHECK(quick_exp2(beside) == Approx(std::exp2(beside)).epsilon(1e-8));
  CHECK(quick_log2(1) == 0);
  CHECK(quick_exp2(0) == 1);
}

TEST_CASE("differences of nine points are exact for polynomials of eighth order") {
  const NinePoints points(0.25);
  const double at = 0.3;
  for (int n = 0; n <= 9; ++n) {
    CAPTURE(n);
    const auto f = [&](double x) { return std::pow(x, n); };
    const double first = n > 0 ? n * std::pow(at, n - 1) : 0;
    const double second = n > 1 ? n * (n - 1) * std::pow(at, n - 2) : 0;
    CHECK(points.second(f, at) == Approx(second).margin(1e-12));
    if (n < 9) CHECK(points.first(f, at) == Approx(first).margin(1e-13));
    const auto nine = points.values(f, at);
    CHECK(nine.value == f(at));
    CHECK(nine.first() == points.first(f, at));
    CHECK(nine.second() == points.second(f, at));
    if (n < 5) CHECK(nine.first_of_fourth_order() == Approx(first).margin(1e-13));
    if (n < 6) CHECK(nine.second_of_fourth_order() == Approx(second).margin(1e-12));
  }
  CHECK(NinePoints().step() == 1.0 / 32);
  double off = 0;
  const auto norm = [](double x) { return std::fabs(x); };
  const NinePoints best = NinePoints::best([](double x) { return std::sin(x); }, 1, norm, &off);
  double least = HUGE_VAL, step = 0;
  for (int n = 3; n <= 16; ++n) {
    const auto wave = [](double x) { return std::sin(x); };
    const double h = std::ldexp(1, -n);
    const double now =
        std::fabs(NinePoints(h).second(wave, 1) - NinePoints(0.5 * h).second(wave, 1));
    if (now < least) least = now, step = h;
  }
  CHECK(best.step() == step);
  CHECK(off == least);
  NinePoints::best([](double x) { return std::fabs(x - 1); }, 1, norm, &off);
  CHECK(off > 1);
}

TEST_CASE("matrices of three rows are what their entries say") {
  const Mat3 a({1, 2, 3}, {-4, 5, 7}, {11, -13, 17}), b({2, -3, 5}, {7, 1, -1}, {0.5, 4, -6});
  const Vec3 u(2, -3, 5), v(7, 11, -13);
  const Mat3 sum = a + b, less = a - b, scaled = 2 * a, part = a / 2, product = a * b;
  Mat3 added = a, taken = a, times = a;
  added += b;
  taken -= b;
  times *= 3;
  const Vec3 image = a * u;
  for (std::size_t i = 0; i < 3; ++i) {
    double row = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      CAPTURE(i, j);
      CHECK(sum(i, j) == a(i, j) + b(i, j));
      CHECK(less(i, j) == a(i, j) - b(i, j));
      CHECK(added(i, j) == sum(i, j));
      CHECK(taken(i, j) == less(i, j));
      CHECK(times(i, j) == 3 * a(i, j));
      CHECK((-a)(i, j) == -a(i, j));
      CHECK(scaled(i, j) == 2 * a(i, j));
      CHECK(part(i, j) == a(i, j) / 2);
      CHECK(transposed(a)(i, j) == a(j, i));
      CHECK(outer(u, v)(i, j) == u[i] * v[j]);
      CHECK(a.column(j)[i] == a(i, j));
      CHECK(Mat3::Identity()(i, j) == (i == j ? 1 : 0));
      CHECK(Mat3::Diagonal(u)(i, j) == (i == j ? u[i] : 0));
      CHECK(Mat3::Zero()(i, j) == 0);
      double entry = 0;
      for (std::size_t k = 0; k < 3; ++k) entry += a(i, k) * b(k, j);
      CHECK(product(i, j) == entry);
      row += a(i, j) * u[j];
    }
    CHECK(image[i] == row);
  }
  CHECK(cross_matrix(u) * v == Vec3(-3 * -13 - 5 * 11, 5 * 7 - 2 * -13, 2 * 11 - -3 * 7));
}

TEST_CASE("places of entries are sorted, counted and found") {
  const Sparsity some(4, {{2, 3}, {0, 1}, {2, 0}, {0, 1}, {3, 2}});
  CHECK(some.size() == 4);
  CHECK(some.count() == 4);
  CHECK(some.begin == std::vector{0, 1, 1, 3, 4});
  CHECK(some.rows == std::vector{1, 0, 3, 2});
  CHECK(some.find(2, 0) == 1);
  CHECK(some.find(2, 3) == 2);
  CHECK(some.find(3, 2) == 3);
  CHECK(some.find(2, 1) == -1);
  CHECK(some.find(1, 2) == -1);
  CHECK(some.find(0, 2) == -1);
}

TEST_CASE("a random function is the spline through its coefficients, its mean square is 1") {
  const RandomSpline function(7, 3), other(7, 4), another(8, 3);
  double mean = 0, square = 0;
  constexpr int kCount = 4000;
  for (int k = 0; k < kCount; ++k) {
    const double s = 0.37 * k - 200;
    const auto knot = static_cast<std::int64_t>(std::floor(s));
    double sum = 0;
    // B(s - k) of a coefficient k is not 0 where s - k + 5 lies in (0, 6).
    for (std::int64_t j = 0; j < 6; ++j)
      sum += function.coefficient(knot + j) * spline(s - static_cast<double>(knot + j) + 5);
    if (k % 20 == 0) CHECK(function.at(s) == Approx(sum).margin(1e-12));
    mean += function.at(s) / kCount;
    square += function.at(s) * function.at(s) / kCount;
  }
  CHECK(std::fabs(mean) < 0.15);
  CHECK(square == Approx(1).margin(0.15));
  double coefficients = 0;
  for (int k = 0; k < kCount; ++k) coefficients += std::pow(function.coefficient(k), 2) / kCount;
  CHECK(coefficients == Approx(1663200.0 / 655177).epsilon(0.05));
  CHECK(function.at(0.3) != other.at(0.3));
  CHECK(function.at(0.3) != another.at(0.3));
  std::array<double, 6> c{};
  for (std::size_t j = 0; j < 6; ++j) c[j] = function.coefficient(2 + static_cast<int>(j));
  const RandomSpline::Polynomial p = RandomSpline::polynomial(c);
  for (const double u : {0.0, 0.2, 0.7, 1.0}) {
    double sum = 0;
    for (std::size_t power = 6; power-- > 0;) sum = sum * u + p[power];
    CHECK(function.at(2 + u) == Approx(sum).margin(1e-13));
  }
}

TEST_CASE("eigenvalues by products are those of the matrix, with what the basis misses") {
  // Companion of (x - 4)(x + 3)(x^2 + 2 x + 5), and one that is symmetric.
  const double companion[4][4] = {{0, 0, 0, 60}, {1, 0, 0, 29}, {0, 1, 0, 9}, {0, 0, 1, -1}};
  const double symmetric[4][4] = {{2, -1, 0, 0}, {-1, 2, -1, 0}, {0, -1, 2, -1}, {0, 0, -1, 2}};
  for (const auto& matrix : {companion, symmetric}) {
    int count = 0;
    const auto product = [&](const double* in, double* out) {
      ++count;
      for (int i = 0; i < 4; ++i) {
        out[i] = 0;
        for (int j = 0; j < 4; ++j) out[i] += matrix[i][j] * in[j];
      }
    };
    const double start[] = {1, 0.4, -0.2, 0.3};
    Arnoldi arnoldi(product, start, 9);
    for (int k = 1; k <= 4; ++k) {
      CHECK(arnoldi.extend());
      CHECK(arnoldi.size() == k);
      CHECK(arnoldi.products() == count);
      // S v - lambda v is as long as rest() times the last number of v in the basis.
      const RitzPairs pairs = arnoldi.pairs();
      REQUIRE(pairs.values.size() == static_cast<std::size_t>(k));
      for (std::size_t i = 0; i < pairs.values.size(); ++i) {
        const auto vector = arnoldi.vector(pairs, i);
        double off = 0;
        for (std::size_t row = 0; row < 4; ++row) {
          std::complex<double> sum = -pairs.values[i] * vector[row];
          for (std::size_t j = 0; j < 4; ++j) sum += matrix[row][j] * vector[j];
          off += std::norm(sum);
        }
        CHECK(std::sqrt(off) == Approx(arnoldi.rest() * std::abs(pairs.last(i))).margin(1e-11));
      }
    }
    CHECK_FALSE(arnoldi.extend());
    CHECK(arnoldi.products() == 4);
    CHECK(arnoldi.rest() == Approx(0).margin(1e-10));
    for (const std::complex<double>& value : arnoldi.values()) {
      const auto x = value;
      const auto polynomial = matrix == companion
                                  ? (x - 4.0) * (x + 3.0) * (x * x + 2.0 * x + 5.0)
                                  : ((2.0 - x) * (2.0 - x) - 1.0) * ((2.0 - x) * (2.0 - x) - 1.0) -
                                        (2.0 - x) * (2.0 - x);
      CHECK(std::abs(polynomial) < 1e-9);
    }
  }
  const double ones[] = {1, 1};
  Arnoldi broken([](const double*, double* out) { out[0] = out[1] = NAN; }, ones, 2);
  CHECK_FALSE(broken.extend());
  CHECK(broken.size() == 0);
  Arnoldi invariant([](const double* in, double* out) { out[0] = 3 * in[0], out[1] = 3 * in[1]; },
                    ones, 2);
  CHECK(invariant.extend());
  CHECK(invariant.rest() == 0);
  CHECK_FALSE(invariant.extend());
  CHECK(invariant.values().front().real() == Approx(3));
}
