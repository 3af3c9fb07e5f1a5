// Embedded Runge-Kutta pairs with dense output as data, with orders checked by the compiler.
#pragma once

#include <array>
#include <cstddef>

#include "core/ode/explicit/order_conditions.h"

namespace sim {

// A method of S stages, an estimate of its error and an interpolant. The stage after the last is
// k_S = f(t + h, x_next), the first of the next step; X further ones serve dense output only.
//
// Error of a step: e = h sum_i error_i k_i. Where `coarse` is not zero it makes a second, much
// larger one, e', and the estimate is e^2 / sqrt(e^2 + 0.01 e'^2): Hairer, Norsett & Wanner,
// Solving ODEs I (1993), section II.10, equation (10.17).
//
// Dense output: the cubic of Hermite through both ends of the step and their derivatives, and D
// rows of weights on top, all of which vanish at the ends together with their derivative:
//   x(t + theta h) = hermite(theta) + h theta^2 (1-theta)^2 sum_i d_i(theta) k_i
//   d = d_0 + theta (d_1 + (1-theta) (d_2 + theta (d_3 + ...)))          (ibid. section II.6)
template <int S, int X = 0, int D = 0>
struct EmbeddedPair {
  static constexpr int kAll = S + 1 + X;

  Tableau<S> method;
  std::array<double, S + 1> error{}, coarse{};
  std::array<std::array<double, kAll>, X> extra_a{};
  std::array<double, X> extra_c{};
  std::array<std::array<double, kAll>, D> dense{};
};

// The weights of the interpolant: x(t + theta h) = x + h sum_i weight_i k_i. Any kind of arrays.
template <class Weights, class Rows, class Out>
constexpr void dense_weights(int stages, const Weights& b, const Rows& rows, double theta,
                             Out& weight) {
  // hermite = x + theta (x_next - x) + theta (1-theta) ((1-theta) (h k_0 - x_next + x)
  //                                                    + theta (x_next - x - h k_S))
  const double rest = 1 - theta, both = theta * rest;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    double d = 0;
    for (std::size_t row = rows.size(); row-- > 0;)
      d = rows[row][i] + (row % 2 == 0 ? theta : rest) * d;
    const double end = static_cast<int>(i) < stages ? b[i] : 0;
    weight[i] = theta * end + both * (theta - rest) * end + both * both * d;
  }
  weight[0] += both * rest;
  weight[static_cast<std::size_t>(stages)] -= both * theta;
}

namespace order {

// All stages as one tableau.
template <int S, int X, int D>
constexpr Tableau<S + 1 + X> all_stages(const EmbeddedPair<S, X, D>& pair) {
  Tableau<S + 1 + X> all;
  for (int i = 0; i < S; ++i) {
    all.c[i] = pair.method.c[i];
    all.a[S][i] = pair.method.b[i];
    for (int j = 0; j < i; ++j) all.a[i][j] = pair.method.a[i][j];
  }
  all.c[S] = 1;
  for (int i = 0; i < X; ++i) {
    all.a[S + 1 + i] = pair.extra_a[i];
    all.c[S + 1 + i] = pair.extra_c[i];
  }
  return all;
}

}  // namespace order

// The order of the embedded method, whose weights are b - error (or b - coarse).
template <int S, int X, int D>
constexpr int embedded_order(const EmbeddedPair<S, X, D>& pair, bool coarse = false) {
  Tableau<S + 1> embedded = order::all_stages(EmbeddedPair<S>{.method = pair.method});
  for (int i = 0; i <= S; ++i)
    embedded.b[i] = (i < S ? pair.method.b[i] : 0) - (coarse ? pair.coarse[i] : pair.error[i]);
  return order_conditions(embedded);
}

// The order of the dense output at every theta. A condition divided by the factor theta^2
// (1-theta)^2 is a polynomial with one coefficient a row, so that as many values of theta decide;
// theta = 1, where it is the step, is another.
template <int S, int X, int D>
constexpr int dense_order(const EmbeddedPair<S, X, D>& pair) {
  constexpr std::size_t kPlaces = D > 0 ? D : 1;
  std::array<order::Weights<S + 1 + X>, kPlaces + 1> weights;
  for (std::size_t n = 0; n <= kPlaces; ++n) {
    weights[n].theta = (n + 1.0) / (kPlaces + 1);
    dense_weights(S, pair.method.b, pair.dense, weights[n].theta, weights[n].b);
  }
  return order::order_of(order::all_stages(pair), weights);
}

}  // namespace sim
