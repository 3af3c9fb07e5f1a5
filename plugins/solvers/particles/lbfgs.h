// L-BFGS: an approximation of the inverse Hessian from the last steps of a descent.
#pragma once

#include <vector>

#include "core/base/array.h"

namespace sim {

// About H^-1 g by the last few steps s and the changes y of g in them, from a given H_0^-1, which
// is applied between two halves:
//   q := g;  q -= a_i y_i,  a_i = s_i.q / s_i.y_i,  the last pair first
//   d := H_0^-1 q;  d += (a_i - y_i.d / s_i.y_i) s_i,  the first pair first
// Positive definite where all s.y > 0. Nocedal (1980), Math. Comp. 35(151), 773-782; from a matrix
// of the springs: Liu, Bouaziz & Kavan (2017), ACM TOG 36(3) 23.
class Lbfgs {
 public:
  explicit Lbfgs(std::size_t size);

  void forget() noexcept { count_ = 0; }
  // A step `length` d, which took the gradient `before` to `after`. Kept if s.y > 0.
  void learn(double length, const Array& d, const Array& before, const Array& after);
  void first_half(Array& q);
  void second_half(Array& d) const;

 private:
  static constexpr std::size_t kPairs = 5;
  struct Pair {
    Array step, change;
    double product = 0, part = 0;  // s.y; a
  };
  const Pair& recent(std::size_t age) const { return pairs_[(next_ + kPairs - 1 - age) % kPairs]; }
  Pair& recent(std::size_t age) { return pairs_[(next_ + kPairs - 1 - age) % kPairs]; }

  std::vector<Pair> pairs_;
  std::size_t next_ = 0, count_ = 0;
};

}  // namespace sim
