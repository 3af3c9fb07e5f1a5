// Derivatives of a function of one number from nine of its values, to eighth order.
#pragma once

#include <cmath>

namespace sim {

// Nine values of a function, at equal steps about a point, and its derivatives there: central
// differences, Fornberg (1988), Math. Comput. 51, 699-706, table 1. Derivatives of fourth order,
// from five of the values, nearly agree with them if the function is smooth.
template <class Value>
struct NineValues {
  double step = 0;
  Value value, sums[5], differences[5];  // f(t + k step) + f(t - k step), and the same with -

  Value first() const {
    return ((4.0 / 5) * differences[1] - (1.0 / 5) * differences[2] + (4.0 / 105) * differences[3] -
            (1.0 / 280) * differences[4]) /
           step;
  }
  Value second() const {
    return ((8.0 / 5) * sums[1] - (1.0 / 5) * sums[2] + (8.0 / 315) * sums[3] -
            (1.0 / 560) * sums[4] - (205.0 / 72) * value) /
           (step * step);
  }
  Value first_of_fourth_order() const {
    return ((2.0 / 3) * differences[1] - (1.0 / 12) * differences[2]) / step;
  }
  Value second_of_fourth_order() const {
    return ((4.0 / 3) * sums[1] - (1.0 / 12) * sums[2] - (5.0 / 2) * value) / (step * step);
  }
};

// The function gives numbers or vectors.
class NinePoints {
 public:
  explicit NinePoints(double step = 0x1p-5) : step_(step) {}

  double step() const { return step_; }

  template <class F>
  auto values(const F& f, double at) const {
    auto nine = pairs(f, at);
    nine.value = f(at);
    return nine;
  }
  template <class F>
  auto first(const F& f, double at) const {
    return pairs(f, at).first();
  }
  template <class F>
  auto second(const F& f, double at) const {
    return values(f, at).second();
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
  // All but the value in the middle.
  template <class F>
  auto pairs(const F& f, double at) const {
    NineValues<decltype(f(at))> nine{step_, {}, {}, {}};
    for (int k = 1; k < 5; ++k) {
      const auto after = f(at + k * step_), before = f(at - k * step_);
      nine.sums[k] = after + before, nine.differences[k] = after - before;
    }
    return nine;
  }

  double step_;
};

}  // namespace sim
