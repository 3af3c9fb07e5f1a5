// A smooth random function of one number: splines over coefficients that follow from a seed.
#pragma once

#include <array>
#include <cstdint>

namespace sim {

// Quintic B-splines over hashed coefficients, b(s) = sum_k c_k B(s - k): four times continuously
// differentiable, so that methods of that order keep it, and known at any s without a past. The c_k
// are uniform, with mean 0 and such that the mean square of b is 1: that is theirs times the
// integral of B^2, B11(0), the middle of the spline of degree 11. |b| <= sqrt(3 / B11(0)) = 2.76.
// De Boor, A Practical Guide to Splines (1978).
class RandomSpline {
 public:
  using Polynomial = std::array<double, 6>;  // its coefficients, of u^0 to u^5

  // Another function for every stream of a seed.
  RandomSpline(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}

  double at(double s) const;
  double coefficient(std::int64_t k) const;

  // sum_j c[j] B(u - j) for 0 <= u <= 1.
  static Polynomial polynomial(const std::array<double, 6>& c);

 private:
  std::uint64_t seed_, stream_;
};

}  // namespace sim
