#include "core/particles/newton_solver.h"

#include <algorithm>
#include <cmath>

#include "core/particles/springs.h"

namespace sim {

NewtonSolver::NewtonSolver(ParticleSystem& system, const StageOptions& options)
    : system_(&system),
      options_(options),
      half_(system.layout().n(), 3),
      matrix_(system),
      linear_(make_linear_solver(matrix_, system, options)) {
  for (Array* vector : {&g_, &z_, &d_, &start_}) *vector = Array(half_.size());
}

void NewtonSolver::place(const Point& at, double s) {
  const Layout& layout = system_->layout();
  const auto rq = layout.axes(at.r), start = half_.axes(std::as_const(start_).data());
  const auto d = half_.axes(std::as_const(d_).data());
  const auto q = layout.axes(at.y), v = layout.axes(at.y, 3);
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < layout.n(); ++i) {
      v[axis][i] = start[axis][i] + s * d[axis][i];
      q[axis][i] = rq[axis][i] + at.tau * v[axis][i];
    }
}

void NewtonSolver::gradient(const Point& at) {
  const Layout& layout = system_->layout();
  const ParticleView view = system_->view(at.t, at.y);
  const auto g = half_.axes(g_.data());
  system_->accelerate(view, g.data());
  ++effort_.evaluations;
  const auto rv = layout.axes(at.r, 3);
  const auto v = layout.axes(at.y, 3);
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < layout.n(); ++i)
      g[axis][i] =
          view.free(i) ? view.mass[i] * ((v[axis][i] - rv[axis][i]) - at.tau * g[axis][i]) : 0.0;
}

double NewtonSolver::norm() {
  return std::sqrt(std::max(matrix_.precondition(g_.data(), z_.data()), 0.0));
}

void NewtonSolver::linearise(const Point& at, bool clamped) {
  matrix_.at(system_->view(at.t, at.y), at.tau, clamped);
}

double NewtonSolver::dot(const Array& a, const Array& b) const {
  double lanes[8] = {};
  for (std::size_t i = 0; i < a.size(); i += 8)
    for (std::size_t lane = 0; lane < 8; ++lane) lanes[lane] += a[i + lane] * b[i + lane];
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

double NewtonSolver::phi(const Point& at) const {
  const ParticleView view = system_->view(at.t, at.y);
  const Motion& motion = system_->motion();
  const auto rv = system_->layout().axes(at.r, 3);
  const Vec3 gravity(motion.gravity[0], motion.gravity[1], motion.gravity[2]);
  double sum = 0;
  for (int i = 0; i < view.n; ++i) {
    if (!view.free(i)) continue;
    const Vec3 v = view.velocity(i), change = v - Vec3(rv[0][i], rv[1][i], rv[2][i]);
    sum += view.mass[i] * (0.5 * change.squaredNorm() - at.tau * gravity.dot(v)) +
           0.5 * at.tau * motion.damping * v.squaredNorm();
  }
  return sum + system_->elastic_energy(at.t, at.y);
}

// d_ := -A^-1 g, with the Hessian clamped where the exact one is not positive definite.
void NewtonSolver::find_direction(const Point& at, double eta) {
  for (double& value : g_.span()) value = -value;
  const auto attempt = [&] {
    const LinearResult result = linear_->solve(matrix_, g_.data(), d_.data(), eta);
    effort_.linear += result.iterations;
    effort_.factorisations += result.factorisations;
    return result.definite;
  };
  bool done = attempt();
  if (!done && options_.hessian == StageOptions::Hessian::kExact) {
    linearise(at, true);
    done = attempt();
  }
  // By rounding errors alone: down the gradient.
  if (!done) matrix_.precondition(g_.data(), d_.data());
  for (double& value : g_.span()) value = -value;
  slope_ = dot(g_, d_);
}

// Shortens the step until Phi falls as it should (Armijo), or without Phi the residual. Where Phi
// falls along the whole step, as it does near a saddle, the step is lengthened.
bool NewtonSolver::search(const Point& at, double before) {
  constexpr int kTrials = 40;
  constexpr double kLeastFall = 1e-4, kStraight = 0.75, kRounding = 1e-14;
  double s = 1;
  if (!matrix_.symmetric()) {
    for (int trial = 0; trial < kTrials; ++trial, s *= 0.5) {
      place(at, s);
      gradient(at);
      if (norm() <= (1 - kLeastFall * s) * before) return true;
    }
    return false;
  }

  const auto phi_at = [&](double length) {
    place(at, length);
    return phi(at);
  };
  const double start = phi_at(0), slope = slope_;
  const auto accept = [&](double length) {
    place(at, length);
    gradient(at);
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
  const Point at{t, tau, r, y};
  const bool single = options_.newton_steps == 1;
  bool clamped = options_.hessian == StageOptions::Hessian::kClamped;
  const auto v = system_->layout().axes(y, 3);
  const auto keep_start = [&] {
    const auto start = half_.axes(start_.data());
    for (int axis = 0; axis < 3; ++axis) std::copy_n(v[axis], half_.n(), start[axis]);
  };
  std::ranges::fill(d_.span(), 0.0);
  keep_start();
  place(at, 0);
  gradient(at);
  linearise(at, clamped);

  double now = norm(), previous = now, eta = 0.1;
  bool searched = false;
  const double first = now;
  for (int step = 0;; ++step) {
    if (!std::isfinite(now)) return StepStatus::kNotFinite;
    const double goal =
        std::max(options_.tolerance * first, 4 * matrix_.rounding(system_->view(t, y)));
    if (now <= goal || (single && step == 1)) break;
    if (step == options_.newton_steps) return StepStatus::kNotConverged;

    // How exactly the linear equations are worth solving: Eisenstat & Walker (1996), SIAM J. Sci.
    // Comput. 17(1), choice 2.
    // Where steps had to be shortened, a better direction is worth more.
    if (step > 0)
      eta = std::min(searched ? 0.1 * eta : 0.1, 0.9 * (now / previous) * (now / previous));
    eta = single ? options_.tolerance : std::max(eta, 0.5 * goal / now);
    find_direction(at, eta);
    ++effort_.newton;
    previous = now;
    place(at, 1);
    gradient(at);
    now = norm();
    searched = !single && !(now <= 0.5 * previous);
    if (searched && !search(at, previous)) return StepStatus::kNotConverged;
    if (single) continue;
    keep_start();
    if (norm() <= goal) continue;
    linearise(at, clamped);
    now = norm();
  }
  if (first > 0) effort_.residual = std::max(effort_.residual, now / first);
  return StepStatus::kDone;
}

std::vector<std::string> NewtonSolver::notes() const {
  std::vector<std::string> list;
  for (const Force* force : matrix_.others().without_blocks())
    list.push_back("force '" + system_->name_of(*force) +
                   "' gives no Jacobian: implicit methods take differences of it, which is slower");
  return list;
}

}  // namespace sim
