#include <algorithm>
#include <cmath>

#include "block_kernels.h"
#include "core/base/assert.h"
#include "linear_solver.h"

namespace sim {
namespace {

// to := factor what
void scale(Array& to, double factor, const Array& what) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = factor * what[i];
}

// True if squared residuals that fell from `first` to `now` in `done` iterations reach the goal in
// `all`.
bool gets_there(double first, double now, double goal, int done, int all) {
  double reached = now;
  for (int left = all - done; left > 0; left -= done) reached *= now / first;
  return reached <= goal;
}

}  // namespace

ConjugateGradient::ConjugateGradient(BlockMatrix& matrix, int most_iterations,
                                     std::unique_ptr<Preconditioner> better)
    : matrix_(&matrix),
      most_(most_iterations),
      r_(matrix.layout().size()),
      z_(r_.size()),
      p_(r_.size()),
      ap_(r_.size()),
      better_(std::move(better)) {}

LinearResult ConjugateGradient::solve(const double* b, double* d, double eta) {
  BlockMatrix& matrix = *matrix_;
  LinearResult result;
  std::copy_n(b, r_.size(), r_.data());
  std::fill_n(d, r_.size(), 0.0);
  std::ranges::fill(p_.span(), 0.0);
  // own: r.D^-1 r, by which the iteration stops; rz: r.z with the whole preconditioner. kSoon:
  // iterations that cost as much as preparing a better preconditioner; kLook: iterations after
  // which the rate of convergence is known.
  constexpr int kSoon = 12, kLook = 4;
  double own = matrix.precondition(r_.data(), z_.data()), rz = own, beta = 0;
  SIM_ASSERT(eta > 0 && !(own < 0));  // D^-1 is symmetric and positive
  const double goal = eta * eta * own;
  const double first = own;
  bool corrected = false;
  while (own > goal && result.iterations < most_ && !matrix.stopped()) {
    const bool slow = result.iterations == kSoon ||
                      (result.iterations == kLook && !gets_there(first, own, goal, kLook, kSoon));
    if (better_ && !corrected && slow && better_->prepare()) {
      corrected = true;
      rz = better_->solve(r_.data(), z_.data());
      beta = 0;
    }
    const double curvature = matrix.turn_and_apply(beta, z_.data(), p_.data(), ap_.data());
    if (!(curvature > 0)) {
      result.definite = false;
      result.downward = p_.data();
      return result;
    }
    own = matrix.advance(rz / curvature, p_.data(), ap_.data(), d, r_.data(), z_.data());
    const double next = corrected ? better_->solve(r_.data(), z_.data()) : own;
    beta = next / rz;
    rz = next;
    if (corrected && !(next > 0)) {  // roundings are all there is: on with the blocks alone
      corrected = false;
      rz = own = matrix.precondition(r_.data(), z_.data());
      beta = 0;
    }
    ++result.iterations;
  }
  result.solved = own <= goal;
  return result;
}

Gmres::Gmres(BlockMatrix& matrix, int most_iterations, std::unique_ptr<Preconditioner> better,
             double stiff, bool symmetric)
    : matrix_(&matrix),
      most_(most_iterations),
      symmetric_(symmetric),
      better_(std::move(better)),
      stiff_(stiff),
      r_(matrix.layout().size()),
      z_(r_.size()) {
  for (int j = 0; j <= kRestart; ++j) basis_.emplace_back(r_.size());
}

void Gmres::precondition(const double* r) {
  if (prepared_)
    better_->solve(r, z_.data());
  else
    matrix_->precondition(r, z_.data());
}

// Conjugate gradients from d on, whose residual is r_; they end where A is not positive definite.
// Three vectors keep what GMRES forgets when it starts anew.
int Gmres::descend(double* d, double goal, int most) {
  BlockMatrix& matrix = *matrix_;
  Array &p = basis_[0], &ap = basis_[1];
  double rz = matrix.precondition(r_.data(), z_.data());
  std::copy_n(z_.data(), z_.size(), p.data());
  int iterations = 0;
  while (iterations < most && !matrix.stopped()) {
    matrix.apply(p.data(), ap.data());
    const double curvature = dot(p, ap);
    if (!(curvature > 0)) break;
    for (std::size_t i = 0; i < p.size(); ++i) d[i] += rz / curvature * p[i];
    add_scaled(r_, -rz / curvature, ap);
    ++iterations;
    if (!(dot(r_, r_) > goal * goal)) break;
    const double next = matrix.precondition(r_.data(), z_.data());
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = z_[i] + next / rz * p[i];
    rz = next;
  }
  return iterations;
}

LinearResult Gmres::solve(const double* b, double* d, double eta) {
  BlockMatrix& matrix = *matrix_;
  LinearResult result;
  // The better preconditioner does not include the inequality constraints that restrict A.
  const bool better = better_ && !matrix.restricted() && matrix.stiffness_ratio() >= stiff_;
  prepared_ = better && better_->prepare();
  result.factorisations = better && better_->factorises();
  std::fill_n(d, r_.size(), 0.0);
  std::copy_n(b, r_.size(), r_.data());
  double norm = std::sqrt(dot(r_, r_));
  const double goal = eta * norm;
  double cosine[kRestart], sine[kRestart], g[kRestart + 1];
  while (norm > goal && result.iterations < most_ && !matrix.stopped()) {
    // The Arnoldi basis v_0 = r / |r|, v_j+1 = A D^-1 v_j made orthogonal to those before.
    scale(basis_[0], 1 / norm, r_);
    g[0] = norm;
    int used = 0;
    while (used < kRestart && std::fabs(g[used]) > goal && result.iterations < most_ &&
           !matrix.stopped()) {
      double* const h = h_[used];
      Array& next = basis_[static_cast<std::size_t>(used) + 1];
      precondition(basis_[static_cast<std::size_t>(used)].data());
      matrix.apply(z_.data(), next.data());
      for (int i = 0; i <= used; ++i) {
        h[i] = dot(next, basis_[static_cast<std::size_t>(i)]);
        add_scaled(next, -h[i], basis_[static_cast<std::size_t>(i)]);
      }
      const double length = std::sqrt(dot(next, next));
      if (length > 0) scale(next, 1 / length, next);

      // Givens rotations keep h triangular and the residual in the last entry of g.
      for (int i = 0; i < used; ++i) {
        const double upper = h[i];
        h[i] = cosine[i] * upper + sine[i] * h[i + 1];
        h[i + 1] = cosine[i] * h[i + 1] - sine[i] * upper;
      }
      const double size = std::sqrt(h[used] * h[used] + length * length);
      if (!(size > 0)) break;
      cosine[used] = h[used] / size;
      sine[used] = length / size;
      h[used] = size;
      g[used + 1] = -sine[used] * g[used];
      g[used] *= cosine[used];
      ++used;
      ++result.iterations;
    }
    if (used == 0) break;
    // d += D^-1 sum_j y_j v_j,  h y = g
    std::ranges::fill(r_.span(), 0.0);
    for (int j = used - 1; j >= 0; --j) {
      double y = g[j];
      for (int l = j + 1; l < used; ++l) y -= h_[l][j] * g[l];
      g[j] = y / h_[j][j];
      add_scaled(r_, g[j], basis_[static_cast<std::size_t>(j)]);
    }
    precondition(r_.data());
    for (std::size_t i = 0; i < z_.size(); ++i) d[i] += z_[i];
    const auto find_residual = [&] {  // r := b - A d
      matrix.apply(d, z_.data());
      for (std::size_t i = 0; i < z_.size(); ++i) r_[i] = b[i] - z_[i];
      return std::sqrt(dot(r_, r_));
    };
    const double before = norm;
    norm = find_residual();
    if (symmetric_ && !prepared_ && !matrix.restricted() && norm > goal) {
      result.iterations += descend(d, 0.9 * goal, most_ - result.iterations);
      norm = find_residual();
    }
    if (norm < 0.99 * before) continue;
    if (!prepared_ || better_->factorises()) break;
    prepared_ = false;  // the blocks alone may get on
  }
  result.solved = norm <= goal;
  return result;
}

}  // namespace sim
