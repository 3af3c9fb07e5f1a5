#include "anderson.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kGrown = 2;   // of the last residual
constexpr double kLost = 1e6;  // of the least one
constexpr double kDependent = 1e-4;
constexpr std::size_t kWider = 4;  // pairs that it holds more after it was full

// Four partial sums, so that additions need not wait for each other.
double dot(std::span<const double> a, std::span<const double> b) {
  double sum[4] = {};
  std::size_t k = 0;
  for (; k + 4 <= a.size(); k += 4)
    for (std::size_t j = 0; j < 4; ++j) sum[j] += a[k + j] * b[k + j];
  for (; k < a.size(); ++k) sum[0] += a[k] * b[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

void subtract(double factor, std::span<const double> b, std::span<double> a) {
  for (std::size_t k = 0; k < a.size(); ++k) a[k] -= factor * b[k];
}

}  // namespace

// Stores the last changes of residual and image, the residuals orthonormal to all before. A change
// that nearly depends on these shows that they are outdated: then it is kept alone.
void Anderson::remember(std::span<const double> residual, std::span<const double> image) {
  if (held_ == window_) held_ = 0, window_ = std::min(kMost, window_ + kWider);
  double whole = 0, size = 0;
  for (;;) {
    const auto a = change_of_residual(held_), b = change_of_image(held_);
    const auto last_residual = part(0), last_image = part(1);
    for (std::size_t k = 0; k < n_; ++k)
      a[k] = residual[k] - last_residual[k], b[k] = image[k] - last_image[k];
    whole = std::sqrt(dot(a, a));
    for (std::size_t j = 0; j < held_; ++j) {
      const double share = dot(a, change_of_residual(j));
      subtract(share, change_of_residual(j), a);
      subtract(share, change_of_image(j), b);
    }
    size = std::sqrt(dot(a, a));
    if (held_ == 0 || size > kDependent * whole) break;
    held_ = 0;
  }
  if (!(size > 0)) return;
  const auto a = change_of_residual(held_), b = change_of_image(held_);
  for (std::size_t k = 0; k < n_; ++k) a[k] /= size, b[k] /= size;
  ++held_;
}

void Anderson::mix(std::span<double> x, std::span<double> g) {
  for (std::size_t k = 0; k < n_; ++k) x[k] = g[k] - x[k];
  const std::span<double> residual = x;
  const double size = std::sqrt(dot(residual, residual));
  if (least_ >= 0 && !(size <= kLost * least_)) {
    std::ranges::copy(part(2), g.begin());
    held_ = 0, last_ = -1;
    alone_ = pause_ *= 2;
    return;
  }
  if (last_ >= 0 && size <= kGrown * last_)
    remember(residual, g);
  else
    held_ = 0;
  if (least_ < 0 || size < least_) {
    least_ = size;
    std::ranges::copy(g, part(2).begin());
  }
  last_ = size;
  std::ranges::copy(residual, part(0).begin());
  std::ranges::copy(g, part(1).begin());
  if (alone_ > 0) {
    --alone_;
    return;
  }
  for (std::size_t j = 0; j < held_; ++j)
    subtract(dot(residual, change_of_residual(j)), change_of_image(j), g);
}

}  // namespace sim
