// The line searches of Newton's method, and L-BFGS, which replaces it where its steps are short.
#include <algorithm>
#include <cmath>

#include "newton_solver.h"

namespace sim {

// Line search from the best point: a step that does not lower Phi is shortened a few times; one at
// whose end Phi falls nearly as steeply as at its start is lengthened until it does not.
void NewtonSolver::stretch(double& length, double slope) {
  constexpr int kShorter = 4, kLonger = 20;
  constexpr double kSteep = 0.5;
  const Array &g = equation_.gradient(), &d = equation_.direction();
  const auto move = [&](double s) {
    equation_.place(s);
    evaluate();
  };
  if (!(equation_.phi() < best_phi_ + noise_)) {
    double trial = length;
    for (int i = 0; i < kShorter; ++i) {
      equation_.place(trial *= 0.25);
      if (!(equation_.phi() < best_phi_ - noise_)) continue;
      length = trial;
      break;
    }
    return move(length);
  }
  for (int i = 0; i < kLonger && dot(g, d) < kSteep * slope; ++i) {
    move(2 * length);
    if (!(dot(g, d) < 0) || !(equation_.phi() < best_phi_ + noise_)) return move(length);
    length *= 2;
  }
}

// Line search along a direction of negative curvature, downhill, as far as Phi falls: returns the
// length in units of the direction, or 0 if Phi does not fall. The first trial rotates no spring by
// more than a degree.
double NewtonSolver::descend(const double* direction) {
  constexpr double kTurn = 0.02;
  constexpr int kShorter = 8, kLonger = 20;
  Array& d = equation_.direction();
  std::copy_n(direction, d.size(), d.data());
  const double turn = matrix_.largest_turn(d.data());
  if (!(turn > 0) || std::isinf(turn)) return 0;
  const double start = equation_.phi();
  const auto fall_at = [&](double length) {
    equation_.place(length);
    return equation_.phi() - start;
  };
  double s = (dot(d, equation_.gradient()) > 0 ? -kTurn : kTurn) / turn;
  double fall = fall_at(s);
  for (int trial = 0; trial < kShorter && !(fall < 0); ++trial) fall = fall_at(s *= 0.5);
  for (int trial = 0; trial < kLonger && fall < 0; ++trial) {
    const double further = fall_at(2 * s);
    if (!(further < fall)) break;
    fall = further;
    s *= 2;
  }
  equation_.place(0);
  return fall < -noise_ ? s : 0;
}

// Preconditioned L-BFGS for an indefinite A, where Phi falls along many narrow curved valleys, as
// of folds about to form, and steps of Newton's method are as short as these are narrow. The
// definite model serves as the initial Hessian throughout; each step costs a preconditioner cycle
// and an evaluation, but no matrix.
bool NewtonSolver::can_use_lbfgs() {
  equation_.place(0);
  evaluate();
  linearise(kSafe);
  return !matrix_.restricted() && linear_->prepare();
}

// True once the residual is at the goal; false if it falls more slowly than by Newton's method.
bool NewtonSolver::minimise_lbfgs(double goal) {
  constexpr int kLook = 20;
  constexpr double kFast = 0.5;  // contraction from look to look
  lbfgs_.forget();
  Array &g = equation_.gradient(), &d = equation_.direction();
  double now = norm(), seen = now;
  for (int i = 0; now > goal && !matrix_.stopped(); ++i) {
    if (i > 0 && i % kLook == 0) {
      if (now > kFast * seen) return false;
      seen = now;
    }
    std::ranges::copy(g.span(), before_.data());
    std::ranges::copy(g.span(), z_.data());
    lbfgs_.first_half(z_);
    linear_->divide(z_.data(), d.data());
    lbfgs_.second_half(d);
    for (double& value : d.span()) value = -value;
    ++effort_.linear;
    const double length = search_flat();
    if (length == 0) return false;
    lbfgs_.learn(length, d, before_, g);
    equation_.start_here();
    now = norm();
  }
  return now <= goal;
}

// Line search along a descent direction by slopes alone, to near the minimum, where the slope is
// well below that at the start. Returns the length, or 0.
double NewtonSolver::search_flat() {
  constexpr double kFlat = 0.7;  // of the slope at the start
  constexpr int kTrials = 20;
  const Array &g = equation_.gradient(), &d = equation_.direction();
  const double slope = dot(g, d);
  double length = 1, low = 0, high = HUGE_VAL, low_slope = slope;
  for (int trial = 0; trial < kTrials && slope < 0; ++trial) {
    equation_.place(length);
    evaluate();
    const double now = dot(g, d);
    if (std::fabs(now) <= -kFlat * slope) return length;
    if (now < 0) {
      low = length;
      low_slope = now;
      length = std::isinf(high) ? 2 * length : 0.5 * (low + high);
    } else {
      high = length;
      const double secant = std::isfinite(now) ? low_slope / (low_slope - now) : 0.0;
      length = low + std::clamp(secant, 0.1, 0.9) * (high - low);
    }
  }
  equation_.place(0);
  evaluate();
  return 0;
}

// Backtracking from the best point, with a definite model: shortens the step until Phi satisfies
// the Armijo condition, or to the length at which a majorant guarantees it. False if Phi falls by
// no more than rounding.
bool NewtonSolver::search_surely() {
  constexpr int kTrials = 30;
  constexpr double kLeastFall = 1e-4;
  find_definite_direction(0.1);
  ++effort_.newton;
  const Array &g = equation_.gradient(), &d = equation_.direction();
  const double slope = dot(g, d), sure = -slope / matrix_.majorant(d.data());
  double s = 1, fall = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    equation_.place(s);
    fall = equation_.phi() - best_phi_;
    if (fall <= kLeastFall * s * slope || s <= sure) break;
    // The minimum of the parabola through the known values.
    const double parabola = -slope * s * s / (2 * (fall - slope * s));
    s = std::isfinite(parabola) ? std::clamp(parabola, 0.1 * s, 0.5 * s) : 0.1 * s;
    s = std::max(s, std::min(sure, 1.0));
  }
  evaluate();
  return fall < -noise_;
}

bool NewtonSolver::search_residual(double before) {
  constexpr int kTrials = 40;
  constexpr double kLeastFall = 1e-4;
  double s = 1;
  for (int trial = 0; trial < kTrials; ++trial, s *= 0.5) {
    equation_.place(s);
    evaluate();
    if (norm() <= (1 - kLeastFall * s) * before) return true;
  }
  return false;
}

}  // namespace sim
