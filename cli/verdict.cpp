#include "cli/verdict.h"

#include <algorithm>
#include <cmath>

#include "cli/format.h"

namespace sim::cli {
namespace {

constexpr double kTolerance = 0.01;
constexpr double kExplosion = 1e6;

std::string percent(double part, double whole) {
  return brief(whole > 0 ? 100 * part / whole : 0, 3) + " %";
}

}  // namespace

const char* trust_name(Trust trust) {
  switch (trust) {
    case Trust::kTrusted:
      return "trusted";
    case Trust::kSuspect:
      return "suspect";
    case Trust::kDiverged:
      break;
  }
  return "diverged";
}

void Monitor::watch(const Energy& energy) {
  if (!start_) start_ = energy;
  last_ = energy.total() - start_->total();
  highest_ = std::max(highest_, last_);
  lowest_ = std::min(lowest_, last_);
  scale_ = std::max(scale_, energy.kinetic + std::abs(energy.potential - start_->potential));
  if (first_scale_ == 0 && scale_ > 0)
    first_scale_ = scale_ + start_->kinetic + std::abs(start_->potential);
}

void Monitor::watch_error(double error, double size) {
  exact_ = true;
  // A comparison with nan is false: not-a-number counts as an infinite error.
  error_ = error <= error_ ? error_ : std::isnan(error) ? INFINITY : error;
  size_ = std::max(size_, size);
}

Verdict Monitor::verdict() const {
  std::string reason;
  bool suspect = false;
  if (highest_ > kExplosion * first_scale_ && first_scale_ > 0)
    return {Trust::kDiverged, "energy rose by " + brief(highest_, 3) + " J, from " +
                                  brief(first_scale_, 3) + " J at the start: the step is unstable"};
  if (exact_) {
    suspect = !(error_ <= kTolerance * size_);
    reason = "largest error " + brief(error_, 3) + " of a solution of size " + brief(size_, 3);
  }
  if (start_) {
    const bool rose = highest_ > kTolerance * scale_;
    const bool fell = conserves_ && -lowest_ > kTolerance * scale_;
    if (!reason.empty()) reason += "; ";
    if (rose) {
      reason += "energy rose by " + brief(highest_, 3) + " J, " + percent(highest_, scale_) +
                " of the " + brief(scale_, 3) + " J in play";
    } else if (fell) {
      reason += "energy fell by " + brief(-lowest_, 3) + " J, " + percent(-lowest_, scale_) +
                " of the " + brief(scale_, 3) + " J in play, and no force takes any";
    } else if (conserves_) {
      reason += "energy stayed within " + percent(std::max(highest_, -lowest_), scale_) +
                " of the " + brief(scale_, 3) + " J in play";
    } else {
      reason += "energy rose by " + percent(highest_, scale_) + " of " + brief(scale_, 3) +
                " J at most; it fell by " + brief(std::max(-last_, 0.0), 3) + " J, unchecked";
    }
    suspect = suspect || rose || fell;
  }
  if (reason.empty()) reason = "all numbers stayed finite (nothing else was checked)";
  return {suspect ? Trust::kSuspect : Trust::kTrusted, reason};
}

}  // namespace sim::cli
