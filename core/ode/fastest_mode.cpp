#include "core/ode/fastest_mode.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>

#include "core/base/array.h"
#include "core/base/noise.h"

namespace sim {
namespace {

using Map = Eigen::Map<Eigen::VectorXd>;

// S^-1 J S with a diagonal S that brings rows and columns to one size. Positions and velocities
// differ by a factor omega in both directions; unscaled, J is so far from normal that Arnoldi's
// values mean little.
class Balanced {
 public:
  Balanced(OdeSystem& system, double t, const double* x)
      : jacobian_(system.jacobian()), scale_(system.size()), scaled_(system.size()) {
    jacobian_->at(t, x);
    // |J r| row by row for a few directions r: the square roots balance it.
    constexpr int kProbes = 4;
    Array probe(system.size()), image(system.size());
    for (int i = 0; i < kProbes; ++i) {
      fill(probe.span());
      jacobian_->apply(probe.data(), image.data());
      for (std::size_t k = 0; k < image.size(); ++k) scale_[k] += image[k] * image[k];
    }
    const double largest = *std::ranges::max_element(scale_.span());
    for (double& scale : scale_.span()) scale = scale > 0 ? std::sqrt(std::sqrt(scale)) : 0;
    moves_ = largest > 0 && std::isfinite(largest);
  }

  bool moves() const { return moves_; }

  // Rows that J never changes are left out.
  void apply(const double* in, double* out) {
    for (std::size_t k = 0; k < scale_.size(); ++k) scaled_[k] = scale_[k] * in[k];
    jacobian_->apply(scaled_.data(), out);
    for (std::size_t k = 0; k < scale_.size(); ++k) out[k] = scale_[k] > 0 ? out[k] / scale_[k] : 0;
  }

  void fill(std::span<double> values) {
    for (double& value : values) value = noise_.next();
  }

 private:
  std::unique_ptr<Jacobian> jacobian_;
  Array scale_, scaled_;
  Noise noise_;
  bool moves_ = false;
};

}  // namespace

// J V_m = V_m H + h v e_m^T with orthonormal V_m: eigenvalues of H approach the extreme ones of J.
FastestMode fastest_mode(OdeSystem& system, double t, const double* x, int products) {
  const auto n = static_cast<Eigen::Index>(system.size());
  const int most = static_cast<int>(std::min<Eigen::Index>(products, n));
  Balanced jacobian(system, t, x);
  if (!jacobian.moves()) return {};

  std::vector<Array> basis;
  for (int i = 0; i <= most; ++i) basis.emplace_back(system.size());
  const auto vector = [&](int i) { return Map(basis[static_cast<std::size_t>(i)].data(), n); };
  jacobian.fill(basis[1].span());
  jacobian.apply(basis[1].data(), basis[0].data());
  vector(0).normalize();

  Eigen::MatrixXd hessenberg = Eigen::MatrixXd::Zero(most + 1, most);
  int size = 0;
  while (size < most) {
    const int j = size++;
    auto next = vector(j + 1);
    jacobian.apply(vector(j).data(), next.data());
    const double before = next.norm();
    for (int pass = 0; pass < 2; ++pass)
      for (int i = 0; i <= j; ++i) {
        const double share = vector(i).dot(next);
        hessenberg(i, j) += share;
        next -= share * vector(i);
      }
    const double rest = next.norm();
    if (!(rest > 1e-9 * before)) break;  // the basis is invariant: the eigenvalues are exact
    hessenberg(j + 1, j) = rest;
    next /= rest;
  }
  if (!hessenberg.allFinite()) return {};
  const Eigen::VectorXcd values = hessenberg.topLeftCorner(size, size).eigenvalues();
  std::complex<double> largest = 0;
  for (const std::complex<double>& value : values)
    if (std::abs(value) > std::abs(largest)) largest = value;
  return {std::abs(largest), -2 * largest.real()};
}

}  // namespace sim
