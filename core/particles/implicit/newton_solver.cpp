#include "core/particles/implicit/newton_solver.h"

#include <algorithm>
#include <cmath>

namespace sim {

NewtonSolver::NewtonSolver(Particles& system, const StageOptions& options,
                           std::function<bool()> stopped)
    : system_(&system),
      options_(options),
      equation_(system),
      matrix_(system, std::move(stopped)),
      linear_(make_linear_solver(matrix_, system, options)),
      z_(equation_.layout().size()) {}

double NewtonSolver::norm() {
  const double squared = matrix_.precondition(equation_.gradient().data(), z_.data());
  return std::sqrt(std::max(squared, 0.0));
}

void NewtonSolver::linearise(bool clamped) {
  matrix_.at(equation_.view(), equation_.tau(), clamped);
}

// d := -A^-1 g, with the Hessian clamped where the exact one is not positive definite.
void NewtonSolver::find_direction(double eta) {
  Array &g = equation_.gradient(), &d = equation_.direction();
  for (double& value : g.span()) value = -value;
  const auto attempt = [&] {
    const LinearResult result = linear_->solve(matrix_, g.data(), d.data(), eta);
    effort_.linear += result.iterations;
    effort_.factorisations += result.factorisations;
    return result.definite;
  };
  bool done = attempt();
  if (!done && options_.hessian == StageOptions::Hessian::kExact) {
    linearise(true);
    done = attempt();
  }
  // By rounding errors alone: down the gradient.
  if (!done) matrix_.precondition(g.data(), d.data());
  for (double& value : g.span()) value = -value;
  slope_ = dot(g, d);
}

// Shortens the step until Phi falls as it should (Armijo), or without Phi the residual. Where Phi
// falls along the whole step, as it does near a saddle, the step is lengthened.
bool NewtonSolver::search(double before) {
  constexpr int kTrials = 40;
  constexpr double kLeastFall = 1e-4, kStraight = 0.75, kRounding = 1e-14;
  double s = 1;
  if (!matrix_.symmetric()) {
    for (int trial = 0; trial < kTrials; ++trial, s *= 0.5) {
      equation_.place(s);
      equation_.evaluate();
      if (norm() <= (1 - kLeastFall * s) * before) return true;
    }
    return false;
  }

  const auto phi_at = [&](double length) {
    equation_.place(length);
    return equation_.phi();
  };
  const double start = phi_at(0), slope = slope_;
  const auto accept = [&](double length) {
    equation_.place(length);
    equation_.evaluate();
    return true;
  };
  for (int trial = 0; trial < kTrials; ++trial) {
    double fall = phi_at(s) - start;
    if (fall <= kLeastFall * s * slope + kRounding * std::fabs(start)) {
      while (trial == 0 && fall < kStraight * s * slope) {
        const double further = phi_at(4 * s) - start;
        if (!(further < fall)) break;
        fall = further;
        s *= 4;
      }
      return accept(s);
    }
    // The lowest point of the parabola through what is known.
    const double parabola = -slope * s * s / (2 * (fall - slope * s));
    s = std::isfinite(parabola) ? std::clamp(parabola, 0.1 * s, 0.5 * s) : 0.1 * s;
  }
  return false;
}

StepStatus NewtonSolver::solve(double t, double tau, const double* r, double* y) {
  const bool single = options_.newton_steps == 1;
  const bool clamped = options_.hessian == StageOptions::Hessian::kClamped;
  equation_.begin(t, tau, r, y);
  equation_.evaluate();
  linearise(clamped);

  double now = norm(), previous = now, eta = 0.1;
  bool searched = false;
  const double first = now;
  for (int step = 0;; ++step) {
    if (!std::isfinite(now)) return StepStatus::kNotFinite;
    const double goal =
        std::max(options_.tolerance * first, 4 * matrix_.rounding(equation_.view()));
    if (now <= goal || (single && step == 1)) break;
    if (step == options_.newton_steps) return StepStatus::kNotConverged;

    // How exactly the linear equations are worth solving: Eisenstat & Walker (1996), SIAM J. Sci.
    // Comput. 17(1), choice 2.
    // Where steps had to be shortened, a better direction is worth more.
    if (step > 0)
      eta = std::min(searched ? 0.1 * eta : 0.1, 0.9 * (now / previous) * (now / previous));
    eta = single ? options_.tolerance : std::max(eta, 0.5 * goal / now);
    find_direction(eta);
    if (matrix_.stopped()) return StepStatus::kStopped;
    ++effort_.newton;
    previous = now;
    equation_.place(1);
    equation_.evaluate();
    now = norm();
    searched = !single && !(now <= 0.5 * previous);
    if (searched && !search(previous)) return StepStatus::kNotConverged;
    if (single) continue;
    equation_.start_here();
    if (norm() <= goal) continue;
    linearise(clamped);
    now = norm();
  }
  if (first > 0) effort_.residual = std::max(effort_.residual, now / first);
  return StepStatus::kDone;
}

Effort NewtonSolver::effort() const {
  Effort effort = effort_;
  effort.evaluations = equation_.evaluations();
  return effort;
}

std::vector<std::string> NewtonSolver::notes() const {
  std::vector<std::string> list;
  for (const Force* force : matrix_.others().without_blocks())
    list.push_back("force '" + system_->name_of(*force) +
                   "' gives no Jacobian: implicit methods take differences of it, which is slower");
  return list;
}

}  // namespace sim
