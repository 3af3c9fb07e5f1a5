// Splitting methods as compositions of two exact flows, and the order conditions the compiler
// checks.
#pragma once

#include <array>

#include "core/ode/plan.h"

namespace sim {

// drift_0, kick_0, drift_1, ... kick_M-1, drift_M in units of the step size h; see SplitPlan.
template <int M>
struct Composition {
  std::array<double, M + 1> drift{};
  std::array<double, M> kick{};

  SplitPlan plan() const { return {{drift.begin(), drift.end()}, {kick.begin(), kick.end()}}; }
};

namespace order {

// A sum of words in two letters that do not commute, 0 = drift and 1 = kick, up to kMostLetters
// letters. The word w of n letters, first letter highest, has its coefficient at 2^n - 1 + w.
inline constexpr int kMostLetters = 6;

struct Words {
  std::array<double, (2 << kMostLetters) - 1> coef{};

  // Multiplies by e^(a X): a word goes on with k letters X with the weight a^k / k!.
  constexpr Words times_exponential(double a, int letter) const {
    Words result = *this;
    for (int n = 0; n < kMostLetters; ++n)
      for (int w = 0; w < 1 << n; ++w) {
        double weight = coef[(1 << n) - 1 + w];
        for (int k = 1, longer = w; n + k <= kMostLetters; ++k) {
          longer = 2 * longer + letter;
          weight *= a / k;
          result.coef[(1 << (n + k)) - 1 + longer] += weight;
        }
      }
    return result;
  }
};

}  // namespace order

// The highest order p (at most 6) such that the composition agrees with e^(A + B), whose word of n
// letters has the coefficient 1/n!, in all words of up to p letters, to 1e-13. For any two flows,
// so with damping too. Hairer, Lubich & Wanner (2006), Geometric Numerical Integration, III.4-5.
template <int M>
constexpr int order_conditions(const Composition<M>& method) {
  order::Words product;
  product.coef[0] = 1;
  for (int i = 0; i <= M; ++i) {
    product = product.times_exponential(method.drift[i], 0);
    if (i < M) product = product.times_exponential(method.kick[i], 1);
  }
  double factorial = 1;
  for (int n = 1; n <= order::kMostLetters; ++n) {
    factorial *= n;
    for (int w = 0; w < 1 << n; ++w) {
      const double error = product.coef[(1 << n) - 1 + w] - 1 / factorial;
      if (!(error < 1e-13 && error > -1e-13)) return n - 1;
    }
  }
  return order::kMostLetters;
}

}  // namespace sim
