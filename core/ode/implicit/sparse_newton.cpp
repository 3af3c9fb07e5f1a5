#include "core/ode/implicit/sparse_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/finite.h"

namespace sim {

SparseNewton::SparseNewton(OdeSystem& system, const StageOptions& options,
                           std::unique_ptr<JacobianEntries> jacobian)
    : StageNewton(system, options),
      options_(options),
      jacobian_(std::move(jacobian)),
      matrix_(make_matrix_solver(jacobian_->sparsity())),
      values_(jacobian_->sparsity().count()) {
  for (Array* array : {&point_, &start_, &guess_, &slope_, &rest_}) *array = Array(size());
}

bool SparseNewton::factorise(double tau) {
  ++effort_.factorisations;
  tau_ = tau;
  known_ = matrix_->factorise(tau, values_);
  return known_;
}

bool SparseNewton::take_jacobian(double t, double tau, const double* y) {
  jacobian_->at(t, y, values_);
  t_ = t;
  std::copy_n(y, size(), point_.data());
  rate_ = 1;
  return factorise(tau);
}

void SparseNewton::linearise(double t, double tau, const double* y) { take_jacobian(t, tau, y); }

bool SparseNewton::divide(Array& x) {
  if (!known_) return false;
  matrix_->solve(x.data());
  return true;
}

// The largest |value_i| / (atol + rtol |y_i|); not a number if one is not finite.
double SparseNewton::weighted(const Array& values, const double* y) const {
  double most = 0, poison = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double ratio = std::fabs(values[i]) / (options_.atol + options_.rtol * std::fabs(y[i]));
    most = ratio > most ? ratio : most;
    poison += 0 * ratio;
  }
  return most + poison;
}

StepStatus SparseNewton::solve(double t, double tau, const double* r, double* y) {
  if (options_.newton_steps == 1) return StageNewton::solve(t, tau, r, y);
  if (options_.atol > 0) return solve_to_weights(t, tau, r, y);
  if (known_) {
    std::copy_n(y, size(), start_.data());
    if (solve_to_residual(t, tau, r, y) == StepStatus::kDone) return StepStatus::kDone;
    std::copy_n(start_.data(), size(), y);
  }
  StepStatus status = StageNewton::solve(t, tau, r, y);
  if (status == StepStatus::kNotConverged && jacobian_->look_again(t, start_.data())) {
    matrix_ = make_matrix_solver(jacobian_->sparsity());
    values_.assign(jacobian_->sparsity().count(), 0);
    std::copy_n(start_.data(), size(), y);
    status = StageNewton::solve(t, tau, r, y);
  }
  return status;
}

// Iterates with the current factors until the residual is a small part of that at the guess.
StepStatus SparseNewton::solve_to_residual(double t, double tau, const double* r, double* y) {
  constexpr int kMost = 20;
  constexpr double kSlow = 0.3, kTolerance = 1e-10;
  const double tolerance = options_.tolerance > 0 ? options_.tolerance : kTolerance;
  if (tau != tau_ && !factorise(tau)) return StepStatus::kNotConverged;
  double first = 0, before = 0;
  for (int n = 0; n < kMost; ++n) {
    system().eval(t, {y, {}}, guess_.data(), slope_.data());
    ++effort_.evaluations;
    double norm = 0, size_of_terms = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      rest_[i] = r[i] + tau * slope_[i] - y[i];
      norm += rest_[i] * rest_[i];
      size_of_terms += std::fabs(y[i]) + std::fabs(r[i]) + std::fabs(tau * slope_[i]);
    }
    norm = std::sqrt(norm);
    if (!std::isfinite(norm)) return StepStatus::kNotFinite;
    if (n == 0) first = norm;
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * size_of_terms;
    const bool done = norm <= std::max(tolerance * first, rounding);
    if (!done && n > 0 && norm > kSlow * before) return StepStatus::kNotConverged;
    before = norm;
    // One more step is cheap and removes the error of J from y.
    if (!done || n > 0) {
      divide(rest_);
      for (std::size_t i = 0; i < size(); ++i) y[i] += rest_[i];
      ++effort_.newton;
    }
    if (done) {
      if (first > 0) effort_.residual = std::max(effort_.residual, norm / first);
      return StepStatus::kDone;
    }
  }
  return StepStatus::kNotConverged;
}

// Iterates until corrections change no number by more than a part of its tolerance. If the method
// shortens a step that is not solved, only one new Jacobian, at the guess, is tried.
StepStatus SparseNewton::solve_to_weights(double t, double tau, const double* r, double* y) {
  constexpr double kPart = 0.05;     // of the tolerance
  constexpr double kOtherTau = 0.3;  // relative: other factors are made
  constexpr double kSlow = 0.8, kOldJacobian = 0.05;
  constexpr int kMost = 6;
  std::copy_n(y, size(), start_.data());
  bool fresh = false;
  if (!known_) {
    fresh = true;
    if (!take_jacobian(t, tau, y)) return StepStatus::kNotConverged;
  } else if (std::fabs(tau / tau_ - 1) > kOtherTau && !factorise(tau)) {
    return StepStatus::kNotConverged;
  }
  StepStatus status = StepStatus::kNotConverged;
  for (;;) {
    // With factors of another tau the error is tau / tau_ in stiff components and none in slow
    // ones: between them lies this factor (Hindmarsh et al. (2005), ACM TOMS 31, 363-396).
    const double relax = 2 / (1 + tau / tau_), other_tau = std::fabs(relax - 1);
    double before = 0;
    status = StepStatus::kNotConverged;
    for (int n = 0; n < kMost; ++n) {
      system().eval(t, {y, {}}, guess_.data(), slope_.data());
      ++effort_.evaluations;
      for (std::size_t i = 0; i < size(); ++i) rest_[i] = relax * (r[i] + tau * slope_[i] - y[i]);
      divide(rest_);
      ++effort_.newton;
      for (std::size_t i = 0; i < size(); ++i) y[i] += rest_[i];
      const double change = weighted(rest_, y);
      if (!std::isfinite(change)) {
        status = StepStatus::kNotFinite;
        break;
      }
      if (n > 0) {
        const double rate = before > 0 ? change / before : 0;
        if (rate > kSlow && change > kPart) break;
        rate_ = std::max(0.3 * rate_, rate);
      }
      // The remaining error is about rate / (1 - rate) times the last correction; before a rate is
      // known for this equation, it is at least the error from another tau and an older J.
      const double rate = n > 0 ? rate_ : std::max({rate_, other_tau, kOldJacobian});
      if (change * std::min(1.0, rate / std::max(1 - rate, 0.1)) <= kPart) return StepStatus::kDone;
      before = change;
    }
    if (fresh) break;
    fresh = true;
    std::copy_n(start_.data(), size(), y);
    if (!take_jacobian(t, tau, y)) return StepStatus::kNotConverged;
  }
  if (status == StepStatus::kNotConverged && jacobian_->look_again(t, start_.data())) {
    matrix_ = make_matrix_solver(jacobian_->sparsity());
    values_.assign(jacobian_->sparsity().count(), 0);
  }
  known_ = false;
  return status;
}

std::vector<double> SparseNewton::memory() const {
  if (!known_) return {};
  std::vector<double> memory{tau_, rate_, t_};
  memory.insert(memory.end(), point_.span().begin(), point_.span().end());
  return memory;
}

void SparseNewton::recall(std::span<const double> memory) {
  constexpr std::size_t kHead = 3;
  known_ = false;
  if (memory.size() != kHead + size() || !all_finite(memory) || !(memory[0] > 0)) return;
  std::ranges::copy(memory.subspan(kHead), start_.data());
  take_jacobian(memory[2], memory[0], start_.data());
  rate_ = memory[1];
}

Effort SparseNewton::effort() const {
  return effort_ + Effort{.evaluations = jacobian_->evaluations()};
}

}  // namespace sim
