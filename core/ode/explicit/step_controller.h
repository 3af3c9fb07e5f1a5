// The step size controller of adaptive methods.
#pragma once

#include <algorithm>

#include "core/math/power.h"

namespace sim {

// Proportional-integral control (Gustafsson 1991, ACM TOMS 17, 533-554; Hairer & Wanner, Solving
// ODEs II (1996), section IV.2, equation (2.43) with the factors recommended there):
//   h_next = h * limited(0.9 error^(-0.7 / k) error_before^(0.4 / k))
// where `error` is scaled so that 1 is the tolerance, and O(h^k). Errors before a step that was
// repeated do not count; a step is never enlarged right after one was rejected.
class StepController {
 public:
  explicit StepController(int k) : k_(k) {}

  // The state on which the next decision depends.
  struct State {
    double h = 0;             // s, of the step to be tried
    double error_before = 1;  // of the last step that stood
    bool repeated = false;    // the last trial was rejected
  };
  State state{};

  // True if the step just tried is accepted; in any case state.h is the step to try next. A step to
  // a state that is not finite has the error nan.
  bool accept(double error) {
    constexpr double kSafety = 0.9, kShrink = 0.2, kGrow = 5;
    if (!(error <= 1)) {
      const double factor = error < kHuge ? kSafety * power(error, -1.0 / k_) : 0;
      state.h *= std::max(kShrink, factor);
      state.repeated = true;
      return false;
    }
    // An error of 0 shows only that the step may grow.
    const double size = std::max(error, kTiny);
    const double factor = kSafety * power(size, -0.7 / k_) * power(state.error_before, 0.4 / k_);
    state.h *= std::clamp(factor, kShrink, state.repeated ? 1.0 : kGrow);
    state.error_before = std::max(size, 1e-4);
    state.repeated = false;
    return true;
  }

 private:
  static constexpr double kTiny = 1e-30, kHuge = 1e30;

  int k_;
};

}  // namespace sim
