#include "lbfgs.h"

#include <algorithm>

#include "block_kernels.h"

namespace sim {

Lbfgs::Lbfgs(std::size_t size) : pairs_(kPairs) {
  for (Pair& pair : pairs_) pair.step = Array(size), pair.change = Array(size);
}

void Lbfgs::learn(double length, const Array& d, const Array& before, const Array& after) {
  constexpr double kLeast = 1e-3;  // of the change of g along d: less tells nothing of curvature
  const double slope = dot(before, d), change = dot(after, d) - slope;
  if (!(change > -kLeast * slope)) return;
  Pair& pair = pairs_[next_];
  std::ranges::fill(pair.step.span(), 0.0);
  add_scaled(pair.step, length, d);
  std::ranges::copy(after.span(), pair.change.data());
  add_scaled(pair.change, -1, before);
  pair.product = length * change;
  next_ = (next_ + 1) % kPairs;
  count_ = std::min(count_ + 1, kPairs);
}

void Lbfgs::first_half(Array& q) {
  for (std::size_t age = 0; age < count_; ++age) {
    Pair& pair = recent(age);
    pair.part = dot(pair.step, q) / pair.product;
    add_scaled(q, -pair.part, pair.change);
  }
}

void Lbfgs::second_half(Array& d) const {
  for (std::size_t age = count_; age-- > 0;) {
    const Pair& pair = recent(age);
    add_scaled(d, pair.part - dot(pair.change, d) / pair.product, pair.step);
  }
}

}  // namespace sim
