// References by extrapolation: exact solutions, and what they cost.
#include "core/study/accuracy/extrapolation.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "core/ode/ode_system.h"

using namespace sim;

namespace {

class Given final : public OdeSystem {
 public:
  using Slope = std::function<void(double t, const double* y, double* dydt)>;
  Given(std::size_t size, Slope slope) : size_(size), slope_(std::move(slope)) {}
  std::size_t size() const noexcept override { return size_; }
  void eval(double t, const Stage& stage, double* y, double* dydt) override {
    ++evaluations;
    times.push_back(t);
    combine(stage, y);
    slope_(t, y, dydt);
  }
  void combine(const Stage& stage, double* out) override {
    for (std::size_t i = 0; i < size_; ++i) {
      out[i] = stage.x[i];
      for (const auto& term : stage.terms) out[i] += term.coef * term.k[i];
    }
  }
  std::int64_t evaluations = 0;
  std::vector<double> times;

 private:
  std::size_t size_;
  Slope slope_;
};

const auto kGoOn = [] { return true; };

}  // namespace

// Gragg's rule of n substeps is the trapezoidal sum of n + 1 values, with an error in h^2 alone:
// the row of j + 1 integrates powers of t up to 2 j + 1, and the one after it agrees.
TEST_CASE("powers of time are integrated by as many rows as they need") {
  for (int n = 0; n <= 9; ++n) {
    CAPTURE(n);
    Given system(1, [&](double t, const double*, double* d) { d[0] = (n + 1) * std::pow(t, n); });
    const double x[] = {0.0};
    study::Extrapolation exact(system, x, 1000);
    REQUIRE(exact.advance(1.5, kGoOn));
    CHECK(exact.x()[0] == Approx(std::pow(1.5, n + 1)).epsilon(2e-14));
    const int rows = std::max(3, n / 2 + 2);  // at least three are asked
    CHECK(exact.evaluations() == 1 + rows * (rows + 1));
    CHECK(system.evaluations == exact.evaluations());
    CHECK(system.times.front() == 0);
    CHECK(system.times.back() == 1.5);
  }
}

TEST_CASE("an oscillator is exact to rounding after many steps, at every time asked for") {
  Given system(2, [](double, const double* y, double* d) { d[0] = y[1], d[1] = -y[0]; });
  const double x[] = {1.0, 0.0};
  study::Extrapolation exact(system, x, 1000000);
  for (const double t : {0.3, 2.0, 2.0, 40.0, 41.0}) {
    REQUIRE(exact.advance(t, kGoOn));
    CHECK(std::fabs(exact.x()[0] - std::cos(t)) < 1e-14 * (1 + t));
    CHECK(std::fabs(exact.x()[1] + std::sin(t)) < 1e-14 * (1 + t));
  }
}

TEST_CASE("a reference that takes too much, is told to end or is not finite says so") {
  Given system(2, [](double, const double* y, double* d) { d[0] = y[1], d[1] = -y[0]; });
  const double x[] = {1.0, 0.0};
  study::Extrapolation few(system, x, 100);
  CHECK_FALSE(few.advance(100, kGoOn));
  CHECK(few.evaluations() > 100);
  CHECK(few.evaluations() <= 100 + 73);  // of a step of eight rows
  study::Extrapolation ended(system, x, 1000);
  CHECK_FALSE(ended.advance(1, [] { return false; }));
  CHECK(ended.evaluations() == 0);

  // y' = y^2 has a pole at t = 1.
  Given pole(1, [](double, const double* y, double* d) { d[0] = y[0] * y[0]; });
  const double one[] = {1.0};
  study::Extrapolation before(pole, one, 1000000);
  REQUIRE(before.advance(0.9, kGoOn));
  CHECK(before.x()[0] == Approx(10).epsilon(1e-12));
  CHECK_FALSE(before.advance(1.1, kGoOn));
}
