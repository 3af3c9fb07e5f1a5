// Smoothing by Chebyshev polynomials of D^-1 A, with D the blocks on the diagonal of A.
#pragma once

#include <cmath>
#include <span>

#include "block_kernels.h"
#include "core/base/array.h"

namespace sim {

// Damping factors of one or two Jacobi steps whose error polynomial is the Chebyshev one on [1/4,
// 1] and [1/6, 1] of a bound on the eigenvalues of D^-1 A.
inline void chebyshev_steps(double bound, std::span<double> steps) {
  if (steps.size() == 1) {
    steps[0] = 8.0 / 5 / bound;
    return;
  }
  constexpr double kRoot = 0.7071067811865476;
  const double mean = 7.0 / 12 * bound, half = 5.0 / 12 * bound;
  steps[0] = 1 / (mean - half * kRoot);
  steps[1] = 1 / (mean + half * kRoot);
}

// The largest eigenvalue of D^-1 A from below, by power iteration; apply(factor) does x := factor
// D^-1 A x.
template <class Apply>
double power_iteration(Array& x, int turns, Apply apply) {
  double largest = 1;
  for (int turn = 0; turn < turns; ++turn) {
    apply(1 / std::sqrt(dot(x, x)));
    largest = std::sqrt(dot(x, x));
  }
  return largest;
}

}  // namespace sim
