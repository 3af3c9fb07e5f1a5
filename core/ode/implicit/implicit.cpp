#include "core/ode/implicit/implicit.h"

#include <algorithm>
#include <complex>

#include "core/base/finite.h"
#include "core/ode/stability.h"

namespace sim {
namespace {

// Finiteness is judged by the state rather than by the solver, whose residual may overflow earlier.
StepStatus judged(StepStatus status, std::span<const double> x_next) {
  if (status == StepStatus::kNotConverged || status == StepStatus::kStopped) return status;
  if (!all_finite(x_next)) return StepStatus::kNotFinite;
  return status == StepStatus::kNotFinite ? StepStatus::kNotConverged : status;
}

// Takes a step, and repeats its stages until the system accepts its end.
template <class TakeStages>
StepStatus take_step(OdeSystem& system, double t, double h, const double* x, double* x_next,
                     const TakeStages& take_stages) {
  for (bool again = false;; again = true) {
    const StepStatus status = take_stages(system.begin_step(t, h, x, again));
    if (status != StepStatus::kDone) return status;
    const StepEnd end = system.end_step(t, h, x, x_next);
    if (end != StepEnd::kAgain)
      return end == StepEnd::kAccepted ? StepStatus::kDone : StepStatus::kNotConverged;
  }
}

Advance one(StepStatus status) { return {status, status == StepStatus::kDone ? 1 : 0}; }

}  // namespace

void DiagonallyImplicit::prepare(OdeSystem& system) {
  if (plan_.stages == 1) options_.reach = plan_.b[0] / plan_.a[0];
  solver_ = system.stage_solver(options_);
  change_.clear();
  for (int i = 0; i < plan_.stages; ++i) change_.emplace_back(system.size());
  r_ = Array(system.size());
  terms_.resize(change_.size());
}

StepStatus DiagonallyImplicit::take_stages(OdeSystem& system, double t, double h, const double* x,
                                           double* x_next) {
  // x + sum over the stages before `count` of weights_j h k_j, from their stored values.
  const auto form = [&](const double* weights, int count) {
    std::size_t used = 0;
    for (int j = 0; j < count; ++j) {
      const double own = plan_.a_at(j, j);
      if (weights[j] != 0)
        terms_[used++] = {own != 0 ? weights[j] / own : weights[j] * h,
                          change_[static_cast<std::size_t>(j)].data()};
    }
    return Stage{x, {terms_.data(), used}};
  };

  std::copy_n(x, system.size(), x_next);
  for (int i = 0; i < plan_.stages; ++i) {
    const double* const row = &plan_.a[static_cast<std::size_t>(i * plan_.stages)];
    double* const change = change_[static_cast<std::size_t>(i)].data();
    const double at = t + plan_.c[static_cast<std::size_t>(i)] * h;
    if (row[i] == 0) {
      system.eval(at, form(row, i), x_next, change);
      ++evaluations_;
      continue;
    }
    // The last solved stage is the guess for the next.
    system.combine(form(row, i), r_.data());
    const StepStatus status = solver_->solve(at, row[i] * h, r_.data(), x_next);
    if (status != StepStatus::kDone) return status;
    const Stage::Term minus{-1, r_.data()};
    system.combine({x_next, {&minus, 1}}, change);
  }
  const bool last_is_next = std::equal(plan_.b.begin(), plan_.b.end(),
                                       plan_.a.end() - static_cast<std::ptrdiff_t>(plan_.stages));
  if (!last_is_next) system.combine(form(plan_.b.data(), plan_.stages), x_next);
  return StepStatus::kDone;
}

Advance DiagonallyImplicit::advance(OdeSystem& system, double t, double h, std::int64_t /*most*/,
                                    const double* x, double* x_next) {
  ++steps_;
  const StepStatus status = take_step(system, t, h, x, x_next, [&](const double* from) {
    return take_stages(system, t, h, from, x_next);
  });
  return one(judged(status, {x_next, system.size()}));
}

Effort DiagonallyImplicit::effort() const {
  return solver_->effort() + Effort{.steps = steps_, .evaluations = evaluations_};
}

// k_i = lambda (x + h sum_{j<=i} a_ij k_j):  with x = 1,
//   h k_i = z (1 + sum_{j<i} a_ij h k_j) / (1 - a_ii z),  R(z) = 1 + sum_i b_i h k_i
double DiagonallyImplicit::amplification(double h_omega, double h_gamma) const {
  const auto radius = [&](std::complex<double> z) {
    std::vector<std::complex<double>> k;
    std::complex<double> next = 1;
    for (int i = 0; i < plan_.stages; ++i) {
      std::complex<double> stage = 1;
      for (int j = 0; j < i; ++j) stage += plan_.a_at(i, j) * k[static_cast<std::size_t>(j)];
      k.push_back(z * stage / (1.0 - plan_.a_at(i, i) * z));
      next += plan_.b[static_cast<std::size_t>(i)] * k.back();
    }
    return std::abs(next);
  };
  const OscillatorPair pair = oscillator_eigenvalues(h_omega, h_gamma);
  return std::max(radius(pair.fast), radius(pair.slow));
}

void Bdf2::prepare(OdeSystem& system) {
  solver_ = system.stage_solver(options_);
  starter_->prepare(system);
  last_ = Array(system.size());
  r_ = Array(system.size());
  last_h_ = 0;
}

Advance Bdf2::advance(OdeSystem& system, double t, double h, std::int64_t /*most*/, const double* x,
                      double* x_next) {
  // A step of another size is made by the starter, and so is the one after it.
  bool starts = last_h_ != h;
  StepStatus status = StepStatus::kDone;
  if (!starts) {
    ++steps_;
    status = take_step(system, t, h, x, x_next, [&](const double* from) {
      starts = from != x;
      if (starts) return StepStatus::kNotConverged;
      const Stage::Term minus{-1, last_.data()};
      system.combine({x, {&minus, 1}}, r_.data());
      const Stage::Term third{1.0 / 3, r_.data()};
      system.combine({x, {&third, 1}}, r_.data());
      std::copy_n(x, system.size(), x_next);
      return solver_->solve(t + h, 2 * h / 3, r_.data(), x_next);
    });
  }
  if (starts) {
    starter_->restart(t, h, x);
    status = starter_->step(system, t, h, x, x_next);
  }
  status = judged(status, {x_next, system.size()});
  if (status == StepStatus::kDone) {
    std::copy_n(x, system.size(), last_.data());
    last_h_ = system.had_impact() ? 0 : h;
  }
  return one(status);
}

std::vector<double> Bdf2::memory() const {
  if (last_h_ == 0) return {};
  std::vector<double> kept{last_h_};
  kept.insert(kept.end(), last_.span().begin(), last_.span().end());
  const std::vector<double> of_solver = solver_->memory();
  kept.insert(kept.end(), of_solver.begin(), of_solver.end());
  return kept;
}

void Bdf2::recall(std::span<const double> memory) {
  last_h_ = 0;
  solver_->restart();
  if (memory.size() < last_.size() + 1) return;
  last_h_ = memory.front();
  std::ranges::copy(memory.subspan(1, last_.size()), last_.data());
  solver_->recall(memory.subspan(last_.size() + 1));
}

Effort Bdf2::effort() const {
  return solver_->effort() + Effort{.steps = steps_} + starter_->effort();
}

// (1 - 2/3 z) zeta^2 - 4/3 zeta + 1/3 = 0:  zeta = (2 +- sqrt(1 + 2 z)) / (3 - 2 z)
double Bdf2::amplification(double h_omega, double h_gamma) const {
  const auto radius = [](std::complex<double> z) {
    const std::complex<double> root = std::sqrt(1.0 + 2.0 * z);
    return std::max(std::abs((2.0 + root) / (3.0 - 2.0 * z)),
                    std::abs((2.0 - root) / (3.0 - 2.0 * z)));
  };
  const OscillatorPair pair = oscillator_eigenvalues(h_omega, h_gamma);
  return std::max(radius(pair.fast), radius(pair.slow));
}

}  // namespace sim
