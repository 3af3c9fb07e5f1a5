// The order conditions of explicit and diagonally implicit Runge-Kutta methods.
#pragma once

#include <array>
#include <cstddef>

#include "core/ode/explicit/tableau.h"

namespace sim {
namespace order {

inline constexpr int kMaxOrder = 8;
inline constexpr int kMaxTrees = 200;  // rooted trees of 1 .. 8 vertices: 1+1+2+4+9+20+48+115

// Equality to rounding: coefficients have 16 digits, and those of high orders are up to 40 and
// cancel.
constexpr bool close(double a, double b) { return a - b < 1e-12 && b - a < 1e-12; }

// x(t + theta h) = x + h sum_i b_i k_i; theta = 1 for the step itself.
template <int S>
struct Weights {
  double theta = 1;
  std::array<double, S> b{};
};

// Rooted trees, grown one order at a time; for each the derivative weights and the density.
//   phi_i(t) = prod over the children u of the root: sum_j a_ij phi_j(u)
//   gamma(t) = |t| prod over the children: gamma(u)
// Weights have order p when sum_i b_i phi_i(t) = theta^|t| / gamma(t) for every tree, |t| <= p.
// Hairer, Norsett & Wanner, Solving ODEs I (1993), section II.2, theorem 2.13.
template <int S, std::size_t N>
class Conditions {
 public:
  constexpr Conditions(const Tableau<S>& method, const std::array<Weights<S>, N>& weights)
      : a_(method.a), weights_(weights) {
    powers_.fill(1);
  }

  // True if the conditions of the next order hold for all weights, given those of lower orders.
  constexpr bool next() {
    Tree root{.vertices = ++order_};
    for (double& phi : root.phi) phi = 1;
    for (std::size_t n = 0; n < N; ++n) powers_[n] *= weights_[n].theta;
    return grow(root, order_ - 1, count_ - 1);
  }

  constexpr int trees() const { return count_; }

 private:
  struct Tree {
    int vertices = 0;
    double gamma = 1;
    double phi[S] = {}, grafted[S] = {};  // grafted_i = sum_j a_ij phi_j
  };

  // Adds children with indices <= `largest` until `missing` vertices are used up, so that every
  // multiset of children appears once.
  constexpr bool grow(const Tree& partial, int missing, int largest) {
    if (missing == 0) return add(partial);
    for (int u = 0; u <= largest && tree_[u].vertices <= missing; ++u) {
      Tree next = partial;
      next.gamma *= tree_[u].gamma;
      for (int i = 0; i < S; ++i) next.phi[i] *= tree_[u].grafted[i];
      if (!grow(next, missing - tree_[u].vertices, u)) return false;
    }
    return true;
  }

  constexpr bool add(const Tree& finished) {
    Tree& tree = tree_[count_++] = finished;
    tree.gamma *= order_;
    for (std::size_t n = 0; n < N; ++n) {
      double sum = 0;
      for (int i = 0; i < S; ++i) sum += weights_[n].b[static_cast<std::size_t>(i)] * tree.phi[i];
      if (!close(sum * tree.gamma, powers_[n])) return false;
    }
    for (int i = 0; i < S && order_ < kMaxOrder; ++i)  // no larger tree needs the largest ones
      for (int j = 0; j <= i; ++j) tree.grafted[i] += a_[i][j] * tree.phi[j];
    return true;
  }

  std::array<std::array<double, S>, S> a_;
  std::array<Weights<S>, N> weights_;
  std::array<double, N> powers_{};
  Tree tree_[kMaxTrees] = {};
  int count_ = 0, order_ = 0;
};

// The highest order that all the weights have; 0 if the rows of a do not add up to c.
template <int S, std::size_t N>
constexpr int order_of(const Tableau<S>& method, const std::array<Weights<S>, N>& weights) {
  for (int i = 0; i < S; ++i) {
    double row = 0;
    for (int j = 0; j <= i; ++j) row += method.a[i][j];
    if (!close(row, method.c[i])) return 0;
  }
  int order = 0;
  Conditions<S, N> conditions(method, weights);
  while (order < kMaxOrder && conditions.next()) ++order;
  return order;
}

}  // namespace order

// The highest order (at most 8) whose conditions all hold, to rounding; else as above.
template <int S>
constexpr int order_conditions(const Tableau<S>& method) {
  return order::order_of(method, std::array{order::Weights<S>{1, method.b}});
}

}  // namespace sim
