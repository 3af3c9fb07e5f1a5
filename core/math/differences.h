// Derivatives of a function of one number from nine of its values, to eighth order.
#pragma once

#include <cmath>

namespace sim {

// Central differences, Fornberg (1988), Math. Comput. 51, 699-706, table 1. The function gives
// numbers or vectors.
class NinePoints {
 public:
  explicit NinePoints(double step = 0x1p-5) : step_(step) {}

  double step() const { return step_; }

  template <class F>
  auto first(const F& f, double at) const {
    const auto pair = [&](int k) { return f(at + k * step_) - f(at - k * step_); };
    return ((4.0 / 5) * pair(1) - (1.0 / 5) * pair(2) + (4.0 / 105) * pair(3) -
            (1.0 / 280) * pair(4)) /
           step_;
  }

  template <class F>
  auto second(const F& f, double at) const {
    const auto pair = [&](int k) { return f(at + k * step_) + f(at - k * step_); };
    return ((8.0 / 5) * pair(1) - (1.0 / 5) * pair(2) + (8.0 / 315) * pair(3) -
            (1.0 / 560) * pair(4) - (205.0 / 72) * f(at)) /
           (step_ * step_);
  }

  // The step, a power of two from 2^-3 to 2^-16, at which halving changes the second derivative
  // least: there truncation and rounding balance. `difference` is that change; a function with a
  // kink has no such step.
  template <class F, class Norm>
  static NinePoints best(const F& f, double at, const Norm& norm, double* difference = nullptr) {
    NinePoints best;
    double least = HUGE_VAL;
    for (double step = 0x1p-3; step >= 0x1p-16; step *= 0.5) {
      const double off =
          norm(NinePoints(step).second(f, at) - NinePoints(0.5 * step).second(f, at));
      if (!(off < least)) continue;
      least = off;
      best = NinePoints(step);
    }
    if (difference) *difference = least;
    return best;
  }

 private:
  double step_;
};

}  // namespace sim
