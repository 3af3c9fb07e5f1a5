#include "rosenbrock_stages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/ode/stability.h"

namespace sim {

void RosenbrockStages::prepare(OdeSystem& system) {
  solver_ = system.linearised_solver();
  if (!solver_)
    throw Error(
        ErrorKind::kScene,
        {"integrator does not fit", "",
         "a Rosenbrock method is for first-order systems whose df/dX is known from formulas, or "
         "of at most 100 numbers",
         "use esdirk43 or trbdf2, or write a field as sim.field.formula"});
  u_.clear();
  for (int i = 0; i < RosenbrockPair::kStages; ++i) u_.emplace_back(system.size());
  for (Array& bend : bend_) bend = Array(system.size());
  time_slope_ = Array(system.size());
  slope_ = Array(system.size());
  linearised_ = false;
  tau_ = 0;
  own_ = {};
}

// J, and df/dt by a forward difference.
void RosenbrockStages::linearise(OdeSystem& system, double t, const double* x,
                                 const double* slope) {
  constexpr double kLeastTime = 1e-5;  // s
  solver_->linearise(t, x);
  const double later =
      t + std::sqrt(std::numeric_limits<double>::epsilon() * std::max(kLeastTime, std::fabs(t)));
  system.eval(later, {x, {}}, slope_.data(), time_slope_.data());
  ++own_.evaluations;
  for (std::size_t i = 0; i < time_slope_.size(); ++i)
    time_slope_[i] = (time_slope_[i] - slope[i]) / (later - t);
  linearised_ = true;
  tau_ = 0;
}

// Multiplied by tau = gamma h the equation of a stage is
//   (I - tau J) u_i = tau f_i + gamma sum_j c_ij u_j + tau h gamma_i df/dt
StepStatus RosenbrockStages::step(OdeSystem& system, double t, double h, const double* x,
                                  const double* slope, double* y, double* error) {
  const double tau = pair_.gamma * h;
  if (!linearised_) linearise(system, t, x, slope);
  if (tau != tau_) {
    tau_ = 0;
    if (!solver_->factorise(tau)) return StepStatus::kNotConverged;
    tau_ = tau;
  }
  std::array<Stage::Term, RosenbrockPair::kStages> terms;
  for (std::size_t i = 0; i < RosenbrockPair::kStages; ++i) {
    std::size_t count = 0;
    for (std::size_t j = 0; j < i; ++j)
      if (pair_.a[i][j] != 0) terms[count++] = {pair_.a[i][j], u_[j].data()};
    if (i > 0) {
      system.eval(t + pair_.alpha[i] * h, {x, {terms.data(), count}}, y, slope_.data());
      ++own_.evaluations;
    }
    const double* const f = i == 0 ? slope : slope_.data();
    double* const u = u_[i].data();
    const double of_time = tau * h * pair_.gammas[i];
    for (std::size_t j = 0; j < i; ++j) terms[j] = {pair_.gamma * pair_.c[i][j], u_[j].data()};
    for (std::size_t k = 0; k < slope_.size(); ++k) {
      double sum = tau * f[k] + of_time * time_slope_[k];
      for (std::size_t j = 0; j < i; ++j) sum += terms[j].coef * terms[j].k[k];
      u[k] = sum;
    }
    solver_->solve(u);
  }
  const Array& last = u_.back();
  for (std::size_t k = 0; k < last.size(); ++k) y[k] += last[k];
  std::copy_n(last.data(), last.size(), error);
  return all_finite({y, last.size()}) ? StepStatus::kDone : StepStatus::kNotFinite;
}

void RosenbrockStages::last_slope(OdeSystem& system, double t, double h, const double* y,
                                  double* slope) {
  system.eval(t + h, {y, {}}, slope_.data(), slope);
  ++own_.evaluations;
  linearised_ = false;
  for (std::size_t row = 0; row < bend_.size(); ++row)
    for (std::size_t k = 0; k < slope_.size(); ++k) {
      double sum = 0;
      for (std::size_t j = 0; j < u_.size(); ++j) sum += pair_.dense[row][j] * u_[j][k];
      bend_[row][k] = sum;
    }
}

void RosenbrockStages::interpolate(double theta, const PairStep& step, double* out) const {
  const double rest = 1 - theta;
  for (std::size_t k = 0; k < step.x.size(); ++k)
    out[k] = rest * step.x[k] + theta * (step.y[k] + rest * (bend_[0][k] + theta * bend_[1][k]));
}

// Dense output is of an order less than the steps.
bool RosenbrockStages::step_inside(OdeSystem& system, double t, double h, const PairStep& step,
                                   double* out) {
  linearised_ = false;
  double* const error = time_slope_.data();  // read no more when the error is written
  const StepStatus status = this->step(system, t, h, step.x.data(), step.slope.data(), out, error);
  linearised_ = false;
  return status == StepStatus::kDone;
}

std::vector<double> RosenbrockStages::memory() const {
  std::vector<double> kept;
  for (const Array& bend : bend_) kept.insert(kept.end(), bend.span().begin(), bend.span().end());
  return kept;
}

bool RosenbrockStages::recall(std::span<const double> memory) {
  linearised_ = false;
  if (memory.size() != bend_.size() * bend_[0].size()) return false;
  for (Array& bend : bend_) {
    std::ranges::copy(memory.first(bend.size()), bend.data());
    memory = memory.subspan(bend.size());
  }
  return true;
}

// The method on x' = z x with steps of size 1.
std::complex<double> RosenbrockStages::stability_function(std::complex<double> z) const {
  std::array<std::complex<double>, RosenbrockPair::kStages> u;
  std::complex<double> y = 1;
  for (std::size_t i = 0; i < u.size(); ++i) {
    y = 1;
    std::complex<double> sum = 0;
    for (std::size_t j = 0; j < i; ++j) {
      y += pair_.a[i][j] * u[j];
      sum += pair_.c[i][j] * u[j];
    }
    u[i] = pair_.gamma * (z * y + sum) / (1.0 - pair_.gamma * z);
  }
  return y + u.back();
}

double RosenbrockStages::amplification(double h_omega, double h_gamma) const {
  const auto [fast, slow] = oscillator_eigenvalues(h_omega, h_gamma);
  return std::max(std::abs(stability_function(fast)), std::abs(stability_function(slow)));
}

}  // namespace sim
