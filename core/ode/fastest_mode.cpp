#include "core/ode/fastest_mode.h"

#include <algorithm>
#include <cmath>

#include "core/base/array.h"
#include "core/base/noise.h"
#include "core/math/arnoldi.h"

namespace sim {
namespace {

// S^-1 J S with a diagonal S that balances rows and columns. Positions and velocities differ by a
// factor omega in both directions; unscaled, J is so far from normal that Ritz values mean little.
class Balanced {
 public:
  Balanced(OdeSystem& system, double t, const double* x)
      : jacobian_(system.jacobian()), scale_(system.size()), scaled_(system.size()) {
    jacobian_->at(t, x);
    // J r| row by row for a few random directions r; its square roots balance J.
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

  // Rows that are zero in J are left out.
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

FastestMode fastest_mode(OdeSystem& system, double t, const double* x, int products) {
  Balanced jacobian(system, t, x);
  if (!jacobian.moves()) return {};

  Array noise(system.size()), start(system.size());
  jacobian.fill(noise.span());
  jacobian.apply(noise.data(), start.data());
  Arnoldi arnoldi([&](const double* in, double* out) { jacobian.apply(in, out); }, start.span(),
                  products);
  for (int i = 0; i < products; ++i) arnoldi.extend();
  if (arnoldi.size() == 0) return {};
  std::complex<double> largest = 0;
  double growth = 0;
  for (const std::complex<double>& value : arnoldi.values()) {
    if (std::abs(value) > std::abs(largest)) largest = value;
    growth = std::max(growth, value.real());
  }
  return {std::abs(largest), -2 * largest.real(), growth};
}

}  // namespace sim
