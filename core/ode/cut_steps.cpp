#include "core/ode/cut_steps.h"

#include <algorithm>

namespace sim {

void CutSteps::prepare(OdeSystem& system) {
  method_->prepare(system);
  from_ = Array(system.size());
  to_ = Array(system.size());
}

Advance CutSteps::advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                          double* x_next) {
  Events* const events = system.events();
  if (!events) return method_->advance(system, t, h, most, x, x_next);
  std::copy_n(x, from_.size(), from_.data());
  bool anew = false;  // the method has to begin again
  double done = 0;
  for (EventSeries series;;) {
    const bool cut = series.cuts();
    if (!cut) events->gave_up();
    const double at = t + done, rest = h - done;
    double length = std::min(rest, series.longest());
    anew = anew || length < rest;
    events->begin(at, rest, from_.data());
    for (int n = 0;; ++n) {
      if (anew) method_->restart(at, length, from_.data());
      StepStatus status = method_->step(system, at, length, from_.data(), to_.data());
      if (system.cancellation().gives_up()) status = StepStatus::kStopped;
      if (status != StepStatus::kDone) {
        std::copy_n(to_.data(), to_.size(), x_next);
        if (status == StepStatus::kStopped) method_->restart(t, h, x);
        return {status};
      }
      const double s =
          cut && n < Events::kTries ? events->first(at, length, from_.data(), to_.data()) : 1;
      if (!(s < 1)) break;
      length *= s;
      anew = true;
    }
    const auto outcome = events->end(at, length, from_.data(), to_.data(), cut);
    if (outcome == Events::Outcome::kNotAllowed) {
      std::copy_n(to_.data(), to_.size(), x_next);
      return {StepStatus::kNotFinite};
    }
    anew = anew || outcome == Events::Outcome::kImpact;
    std::swap(from_, to_);
    if (length == rest) break;
    series.add(true, length);
    done += length;
  }
  std::copy_n(from_.data(), from_.size(), x_next);
  if (anew) method_->restart(t + h, h, x_next);
  return {StepStatus::kDone, 1};
}

}  // namespace sim
