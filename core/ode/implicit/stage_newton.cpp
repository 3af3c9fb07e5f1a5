#include "core/ode/implicit/stage_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/ode/jacobian_effort.h"

namespace sim {

StageNewton::StageNewton(OdeSystem& system, const StageOptions& options)
    : system_(&system), options_(options), jacobian_(system.jacobian()), size_(system.size()) {
  if (options_.method != StageOptions::Method::kNewton)
    throw Error(ErrorKind::kScene, {"integrator does not fit", "",
                                    "projective dynamics is for particles with springs, and this "
                                    "system is of first order",
                                    "use implicit_euler"});
  for (Array* array : {&f_, &g_, &start_, &step_, &point_}) *array = Array(size_);
}

Effort StageNewton::effort() const {
  Effort effort = effort_;
  effort.evaluations += evaluations_of(*jacobian_);
  return effort;
}

// g := y - tau f(t, y) - r; its norm.
double StageNewton::residual(double t, double tau, const double* r, const double* y) {
  system_->eval(t, {y, {}}, point_.data(), f_.data());
  ++effort_.evaluations;
  double sum = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    g_[i] = (y[i] - r[i]) - tau * f_[i];
    sum += g_[i] * g_[i];
  }
  return std::sqrt(sum);
}

// y := start + s d, and its residual.
double StageNewton::move(double t, double tau, const double* r, double* y, double s) {
  for (std::size_t i = 0; i < size_; ++i) y[i] = start_[i] + s * step_[i];
  return residual(t, tau, r, y);
}

bool StageNewton::find_step(const double* y) {
  for (std::size_t i = 0; i < size_; ++i) step_[i] = -g_[i];
  if (!divide(step_)) return false;
  std::copy_n(y, size_, start_.data());
  ++effort_.newton;
  return true;
}

StepStatus StageNewton::solve(double t, double tau, const double* r, double* y) {
  constexpr int kHalvings = 40;
  constexpr double kLittle = 1e-6;                        // of the first residual
  constexpr double kLeastFall = 1e-4, kTolerance = 1e-8;  // steps are cheap
  const bool single = options_.newton_steps == 1;
  double norm = residual(t, tau, r, y);
  const double first = norm, tolerance = options_.tolerance > 0 ? options_.tolerance : kTolerance;
  int step = 0;
  bool stalled = false;
  for (; !stalled; ++step) {
    if (!std::isfinite(norm)) return StepStatus::kNotFinite;
    if (system_->stopped()) return StepStatus::kStopped;
    // The rounding error of the three terms of the residual.
    double size = 0;
    for (std::size_t i = 0; i < size_; ++i)
      size += std::fabs(y[i]) + std::fabs(r[i]) + std::fabs(tau * f_[i]);
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * size;
    if (norm <= std::max(tolerance * first, rounding) || (single && step == 1)) break;
    if (step == options_.newton_steps) return StepStatus::kNotConverged;

    linearise(t, tau, y);
    if (!find_step(y)) return StepStatus::kNotConverged;
    const double before = norm;
    double s = 1;
    norm = move(t, tau, r, y, s);
    for (int halving = 0; !single && !(norm <= (1 - kLeastFall * s) * before); ++halving) {
      if (halving == kHalvings) {
        // Rounding errors of f itself, as of stiff constraints, end the iteration if the residual
        // is small.
        if (!(before <= kLittle * first)) return StepStatus::kNotConverged;
        norm = move(t, tau, r, y, 0);
        stalled = true;
        break;
      }
      s *= 0.5;
      norm = move(t, tau, r, y, s);
    }
  }
  // One more step is cheap and removes the error of J from y.
  if (step > 0 && !stalled && find_step(y)) {
    const double last = move(t, tau, r, y, 1);
    norm = last <= norm ? last : move(t, tau, r, y, 0);
  }
  if (first > 0) effort_.residual = std::max(effort_.residual, norm / first);
  return StepStatus::kDone;
}

}  // namespace sim
