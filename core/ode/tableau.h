// Butcher tableaus of explicit Runge-Kutta methods, and the order conditions the compiler checks.
#pragma once

#include <array>

namespace sim {

// y_i = x + h sum_{j<i} a_ij k_j,  k_i = f(t + c_i h, y_i),  x_next = x + h sum_i b_i k_i.
template <int S>
struct Tableau {
  std::array<std::array<double, S>, S> a{};
  std::array<double, S> b{};
  std::array<double, S> c{};
};

namespace order {

inline constexpr int kMaxOrder = 6;
inline constexpr int kMaxTrees = 37;  // rooted trees with 1 .. 6 vertices: 1+1+2+4+9+20

constexpr bool close(double a, double b) { return a - b < 1e-14 && b - a < 1e-14; }

// Rooted trees, grown one order at a time; for each the derivative weights and the density.
//   phi_i(t) = prod over the children u of the root: sum_j a_ij phi_j(u)
//   gamma(t) = |t| prod over the children: gamma(u)
// The method has order p when sum_i b_i phi_i(t) = 1 / gamma(t) for every tree with |t| <= p.
// Hairer, Norsett & Wanner, Solving ODEs I (1993), section II.2, theorem 2.13.
template <int S>
struct Trees {
  struct Tree {
    int vertices = 0;
    double gamma = 1;
    std::array<double, S> phi{}, grafted{};  // grafted_i = sum_j a_ij phi_j
  };
  std::array<Tree, kMaxTrees> tree{};
  int count = 0;

  // Adds children with indices <= `largest` until `missing` vertices are used up, so that every
  // multiset of children appears once.
  constexpr void grow(const Tableau<S>& m, Tree partial, int missing, int largest) {
    if (missing == 0) {
      partial.gamma *= partial.vertices;
      for (int i = 0; i < S; ++i)
        for (int j = 0; j < S; ++j) partial.grafted[i] += m.a[i][j] * partial.phi[j];
      tree[count++] = partial;
      return;
    }
    for (int u = 0; u <= largest; ++u) {
      if (tree[u].vertices > missing) continue;
      Tree next = partial;
      next.gamma *= tree[u].gamma;
      for (int i = 0; i < S; ++i) next.phi[i] *= tree[u].grafted[i];
      grow(m, next, missing - tree[u].vertices, u);
    }
  }
};

}  // namespace order

// The highest order (at most 6) whose conditions all hold, to 1e-14; 0 when the rows of a do not
// add up to c or sum b is not 1.
template <int S>
constexpr int order_conditions(const Tableau<S>& method) {
  for (int i = 0; i < S; ++i) {
    double row = 0;
    for (int j = 0; j < S; ++j) row += method.a[i][j];
    if (!order::close(row, method.c[i])) return 0;
  }
  order::Trees<S> trees;
  for (int p = 1; p <= order::kMaxOrder; ++p) {
    const int first = trees.count;
    typename order::Trees<S>::Tree root;
    root.vertices = p;
    root.phi.fill(1);
    trees.grow(method, root, p - 1, first - 1);
    for (int t = first; t < trees.count; ++t) {
      double sum = 0;
      for (int i = 0; i < S; ++i) sum += method.b[i] * trees.tree[t].phi[i];
      if (!order::close(sum * trees.tree[t].gamma, 1)) return p - 1;
    }
  }
  return order::kMaxOrder;
}

}  // namespace sim
