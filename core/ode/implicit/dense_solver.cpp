#include "core/ode/implicit/dense_solver.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"

namespace sim {
namespace {

Eigen::Map<Eigen::VectorXd> vector(Array& array, std::size_t size) {
  return {array.data(), static_cast<Eigen::Index>(size)};
}

}  // namespace

struct DenseSolver::Matrices {
  explicit Matrices(Eigen::Index n)
      : a(Eigen::MatrixXd::Zero(n, n)), lu(n), step(Eigen::VectorXd::Zero(n)) {}
  Eigen::MatrixXd a;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
  Eigen::VectorXd step;
};

DenseSolver::DenseSolver(OdeSystem& system, const StageOptions& options)
    : system_(&system), options_(options), size_(system.size()) {
  if (options.method != StageOptions::Method::kNewton)
    throw Error(ErrorKind::kScene, {"integrator does not fit", "",
                                    "projective dynamics is for particles with springs, and this "
                                    "system is of first order",
                                    "use implicit_euler"});
  if (size_ > kMostNumbers)
    throw Error(ErrorKind::kScene, {"integrator does not fit", "",
                                    "an implicit method would need a dense matrix for the " +
                                        std::to_string(size_) + " numbers of this state; at most " +
                                        std::to_string(kMostNumbers) + " are allowed",
                                    "use rk4"});
  jacobian_ = system.jacobian();
  for (Array* array : {&f_, &g_, &start_, &unit_, &column_, &point_}) *array = Array(size_);
  matrices_ = std::make_unique<Matrices>(static_cast<Eigen::Index>(size_));
}

DenseSolver::~DenseSolver() = default;

// g := y - tau f(t, y) - r; its norm.
double DenseSolver::residual(double t, double tau, const double* r, const double* y) {
  system_->eval(t, {y, {}}, point_.data(), f_.data());
  ++effort_.evaluations;
  double sum = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    g_[i] = (y[i] - r[i]) - tau * f_[i];
    sum += g_[i] * g_[i];
  }
  return std::sqrt(sum);
}

void DenseSolver::linearise(double t, double tau, const double* y) {
  jacobian_->at(t, y);
  for (std::size_t j = 0; j < size_; ++j) {
    unit_[j] = 1;
    jacobian_->apply(unit_.data(), column_.data());
    unit_[j] = 0;
    matrices_->a.col(static_cast<Eigen::Index>(j)) = -tau * vector(column_, size_);
  }
  matrices_->a.diagonal().array() += 1;
  matrices_->lu.compute(matrices_->a);
  ++effort_.factorisations;
}

// y := start + s d, and its residual.
double DenseSolver::move(double t, double tau, const double* r, double* y, double s) {
  for (std::size_t i = 0; i < size_; ++i)
    y[i] = start_[i] + s * matrices_->step[static_cast<Eigen::Index>(i)];
  return residual(t, tau, r, y);
}

void DenseSolver::find_step(const double* y) {
  matrices_->step = matrices_->lu.solve(-vector(g_, size_));
  std::copy_n(y, size_, start_.data());
  ++effort_.newton;
}

StepStatus DenseSolver::solve(double t, double tau, const double* r, double* y) {
  constexpr int kHalvings = 40;
  constexpr double kLeastFall = 1e-4, kTolerance = 1e-8;  // the factors are there, steps are cheap
  const bool single = options_.newton_steps == 1;
  double norm = residual(t, tau, r, y);
  const double first = norm, tolerance = options_.tolerance > 0 ? options_.tolerance : kTolerance;
  int step = 0;
  for (;; ++step) {
    if (!std::isfinite(norm)) return StepStatus::kNotFinite;
    // Roundings of the three terms of the residual.
    double size = 0;
    for (std::size_t i = 0; i < size_; ++i)
      size += std::fabs(y[i]) + std::fabs(r[i]) + std::fabs(tau * f_[i]);
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * size;
    if (norm <= std::max(tolerance * first, rounding) || (single && step == 1)) break;
    if (step == options_.newton_steps) return StepStatus::kNotConverged;

    linearise(t, tau, y);
    find_step(y);
    const double before = norm;
    double s = 1;
    norm = move(t, tau, r, y, s);
    for (int halving = 0; !single && !(norm <= (1 - kLeastFall * s) * before); ++halving) {
      if (halving == kHalvings) return StepStatus::kNotConverged;
      s *= 0.5;
      norm = move(t, tau, r, y, s);
    }
  }
  // The factors are there: one more step costs little and takes the error of J out of y.
  if (step > 0) {
    find_step(y);
    const double last = move(t, tau, r, y, 1);
    norm = last <= norm ? last : move(t, tau, r, y, 0);
  }
  if (first > 0) effort_.residual = std::max(effort_.residual, norm / first);
  return StepStatus::kDone;
}

}  // namespace sim
