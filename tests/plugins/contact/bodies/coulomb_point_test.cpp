// A contact point by itself, and the mixing that accelerates sweeps over many.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

#include "plugins/contact/bodies/anderson.h"
#include "plugins/contact/bodies/coulomb_point.h"

using namespace sim;

namespace {

// Numbers between -1 and 1, the same each time.
class Numbers {
 public:
  double next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return 2 * static_cast<double>(state_ >> 11) / 9007199254740992.0 - 1;
  }
  Vec3 vector() {
    const double x = next(), y = next(), z = next();
    return {x, y, z};
  }

 private:
  std::uint64_t state_ = 1;
};

// A corner of a body of 1 kg: 1/m + what it turns.
Mat3 response_of(Numbers& numbers) {
  const Mat3 arm = cross_matrix(numbers.vector());
  return Mat3::Identity() + arm * transposed(arm) * 2.0;
}

// The residual of Signorini's and Coulomb's laws, m/s.
double law_error(const Mat3& W, double friction, const Vec3& w, const Vec3& p) {
  const double pull = std::sqrt(p[1] * p[1] + p[2] * p[2]),
               slip = std::sqrt(w[1] * w[1] + w[2] * w[2]);
  double error = std::max(-p[0], pull - friction * p[0]) * W(0, 0);
  error = std::max(error, p[0] > 0 ? std::fabs(w[0]) : -w[0]);
  if (p[0] > 0 && slip > 1e-12 && friction > 0) {
    error = std::max(error, std::fabs(pull - friction * p[0]) * W(1, 1));
    error = std::max(error, std::fabs(p[1] * w[2] - p[2] * w[1]) / std::max(pull, 1e-300));
    error = std::max(error, p[1] * w[1] + p[2] * w[2]);
  }
  return error;
}

}  // namespace

TEST_CASE("the impulse of one point obeys Signorini's and Coulomb's laws to rounding", "[rigid]") {
  Numbers numbers;
  int open = 0, stuck = 0, slipped = 0;
  for (int n = 0; n < 20000; ++n) {
    const Mat3 W = response_of(numbers);
    const PointResponse point = PointResponse::of(W);
    const double friction = n % 10 == 0 ? 0 : 0.25 * (n % 5);
    const Vec3 w = numbers.vector(), p(std::fabs(numbers.next()), 0.1 * numbers.next(), 0.1);
    const Vec3 next = coulomb_impulse(point, friction, w, p);
    const Vec3 after = w + W * (next - p);
    INFO(n);
    CHECK(law_error(W, friction, after, next) < 1e-13 * (1 + 10 * next.norm()));
    // The solution stays where it is.
    CHECK((coulomb_impulse(point, friction, after, next) - next).norm() < 1e-13);
    if (next[0] == 0) ++open;
    if (next[0] > 0) ++(after.norm() < 1e-12 ? stuck : slipped);
  }
  CHECK(open > 1000);
  CHECK(stuck > 1000);
  CHECK(slipped > 1000);
}

TEST_CASE("the projection onto Coulomb's law is the nearest friction, and its slope its derivative",
          "[rigid]") {
  constexpr double kFriction = 0.4, kStep = 1e-6;
  const Vec3 sticks(2, 0.5, -0.3), slips(2, 3, -4), parts(-1, 2, 2);
  CHECK(within_coulomb(sticks, kFriction) == sticks);
  CHECK(within_coulomb(parts, kFriction) == Vec3());
  CHECK((within_coulomb(slips, kFriction) - Vec3(2, 0.48, -0.64)).norm() < 1e-15);
  CHECK(within_coulomb(slips, 0) == Vec3(2, 0, 0));
  for (const double friction : {0.0, kFriction})
    for (const Vec3& a : {sticks, slips, parts}) {
      Mat3 slope;
      within_coulomb(a, friction, &slope);
      for (std::size_t k = 0; k < 3; ++k) {
        Vec3 step;
        step[k] = kStep;
        const Vec3 change = within_coulomb(a + step, friction) - within_coulomb(a - step, friction);
        CHECK((change / (2 * kStep) - slope.column(k)).norm() < 1e-9);
      }
    }
}

TEST_CASE("mixing finds the fixed point of a linear iteration in few steps", "[rigid]") {
  // x -> x + 0.1 (b - A x), tridiagonal and not symmetric: alone it takes hundreds.
  constexpr int kN = 6;
  const auto image = [](const std::vector<double>& x, std::vector<double>& g) {
    double residual = 0;
    for (std::size_t i = 0; i < kN; ++i) {
      double r = 1 - 2 * x[i];
      if (i > 0) r += 1.1 * x[i - 1];
      if (i + 1 < kN) r += 0.9 * x[i + 1];
      g[i] = x[i] + 0.1 * r;
      residual = std::max(residual, std::fabs(r));
    }
    return residual;
  };
  const auto steps = [&](bool mixed) {
    std::vector<double> x(kN), g(kN), memory(Anderson::memory(kN));
    Anderson anderson(memory, kN);
    for (int n = 1; n < 5000; ++n) {
      if (image(x, g) < 1e-12) return n;
      if (mixed) anderson.mix(x, g);
      x = g;
    }
    return 5000;
  };
  CHECK(steps(true) <= 3 * kN);
  CHECK(steps(false) > 200);
}
