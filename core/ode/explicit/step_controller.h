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
//
// Predictive control (Gustafsson 1994, ACM TOMS 20, 496-517; Hairer & Wanner, section IV.8,
// equation (8.24)) expects that the coefficient of h^k changes as it did, and has fewer rejected
// steps where a stiff system becomes fast; the smaller one of
//   h_next = h * limited(0.9 error^(-1 / k))
//   h_next = h * limited(0.9 error^(-1 / k) (h / h_before) (error_before / error)^(1 / k))
class StepController {
 public:
  enum class Control { kProportionalIntegral, kPredictive };

  explicit StepController(int k, Control control = Control::kProportionalIntegral)
      : k_(k), control_(control) {}

  // The state on which the next decision depends.
  struct State {
    double h = 0;             // s, of the step to be tried
    double error_before = 1;  // of the last step that stood
    bool repeated = false;    // the last trial was rejected
  };
  State state{};

  // True if the step just tried is accepted; in any case state.h is the step to try next. A step to
  // a state that is not finite has the error nan. h_before: of the accepted step before; 0: none.
  bool accept(double error, double h_before = 0) {
    constexpr double kSafety = 0.9, kShrink = 0.2, kGrow = 5;
    if (!(error <= 1)) {
      const double factor = error < kHuge ? kSafety * quick_exp2(-quick_log2(error) / k_) : 0;
      state.h *= std::max(kShrink, factor);
      state.repeated = true;
      return false;
    }
    // An error of 0 shows only that the step may grow.
    const double size = std::max(error, kTiny);
    const double log = quick_log2(size);
    double factor = 0, least_before = kLeastBefore;
    if (control_ == Control::kProportionalIntegral) {
      factor = kSafety * quick_exp2((0.4 * log_before() - 0.7 * log) / k_);
    } else {
      factor = kSafety * quick_exp2(-log / k_);
      if (h_before > 0)
        factor *= std::min(1.0, state.h / h_before * quick_exp2((log_before() - log) / k_));
      least_before = kLeastPredicted;
    }
    state.h *= std::clamp(factor, kShrink, state.repeated ? 1.0 : kGrow);
    state.repeated = false;
    state.error_before = std::max(size, least_before);
    if (size >= least_before) {
      log_of_ = size;
      log_ = log;
    }
    return true;
  }

 private:
  static constexpr double kTiny = 1e-30, kHuge = 1e30, kLeastBefore = 1e-4;
  static constexpr double kLeastPredicted = 1e-2;

  // A logarithm takes as long as an evaluation of a small system.
  double log_before() {
    if (state.error_before != log_of_) {
      log_of_ = state.error_before;
      log_ = quick_log2(log_of_);
    }
    return log_;
  }

  int k_;
  Control control_;
  double log_of_ = 0, log_ = 0;  // a number and its logarithm to base 2; 0: none
};

}  // namespace sim
