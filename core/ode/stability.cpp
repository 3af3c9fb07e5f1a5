#include "core/ode/stability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/math/exponential.h"
#include "core/ode/integrator.h"

namespace sim {
namespace {

// Rounding errors of radii are about 1e-16.
constexpr double kSurelyAbove = 1e-13, kAbove = 1e-15;

}  // namespace

OscillatorPair oscillator_eigenvalues(double h_omega, double h_gamma) {
  const double half = 0.5 * h_gamma;
  const double square = half * half - h_omega * h_omega;
  if (square <= 0) {
    const std::complex<double> z(-half, std::sqrt(-square));
    return {z, std::conj(z)};
  }
  // The slow eigenvalue from the product of both, which avoids cancellation.
  const double fast = -half - std::copysign(std::sqrt(square), half);
  return {fast, h_omega * h_omega / fast};
}

std::complex<double> stability_function(const ExplicitPlan& plan, std::complex<double> z) {
  std::vector<std::complex<double>> k(static_cast<std::size_t>(plan.stages));
  std::complex<double> sum = 0;
  for (int i = 0; i < plan.stages; ++i) {
    std::complex<double> inner = 0;
    for (int j = 0; j < i; ++j) inner += plan.a_at(i, j) * k[static_cast<std::size_t>(j)];
    const auto row = static_cast<std::size_t>(i);
    k[row] = 1.0 + z * inner;
    sum += plan.b[row] * k[row];
  }
  return 1.0 + z * sum;
}

double amplification(const ExplicitPlan& plan, double h_omega, double h_gamma) {
  const auto [fast, slow] = oscillator_eigenvalues(h_omega, h_gamma);
  return std::max(std::abs(stability_function(plan, fast)),
                  std::abs(stability_function(plan, slow)));
}

double amplification(const SplitPlan& plan, double h_omega, double h_gamma, bool midpoint_kicks) {
  // v := keep v + gain a; by the explicit midpoint rule with z = gamma k h: keep = 1 - z + z^2/2.
  const auto flow = [&](double kick) {
    const double z = h_gamma * kick;
    return midpoint_kicks ? Damping{1 - z + 0.5 * z * z, kick * (1 - 0.5 * z)}
                          : damping(h_gamma, kick);
  };
  // Column by column, the images of (q, h v) = (1, 0) and of (0, 1) under the step.
  std::array<std::array<double, 2>, 2> m{{{1, 0}, {0, 1}}};
  for (auto& [q, p] : m) {
    q += plan.drift[0] * p;
    for (std::size_t i = 0; i < plan.kick.size(); ++i) {
      const Damping d = flow(plan.kick[i]);
      p = d.keep * p - d.gain * h_omega * h_omega * q;
      q += plan.drift[i + 1] * p;
    }
  }

  // Drifts have determinant 1 and kicks that of their flow, whatever the rounding of m.
  double kicks = 0, product = 1;
  for (const double kick : plan.kick) {
    kicks += kick;
    product *= flow(kick).keep;
  }
  const double determinant = midpoint_kicks ? product : damping(h_gamma, kicks).keep;
  const double half_difference = 0.5 * (m[0][0] - m[1][1]);
  const double square = half_difference * half_difference + m[0][1] * m[1][0];
  if (square <= 0) return std::sqrt(determinant);
  return 0.5 * std::abs(m[0][0] + m[1][1]) + std::sqrt(square);
}

double stable_step(const Amplification& radius, double omega, double gamma) {
  const double rate = std::max(omega, gamma);
  if (!(rate > 0)) return std::numeric_limits<double>::infinity();
  const auto excess = [&](double h) { return radius(h * omega, h * gamma) - 1; };

  // The first step that grows, on a grid of h rate = 1e-7 .. 1e6.
  constexpr double kFirst = 1e-7, kLast = 1e6, kRatio = 1.02;
  double h = kFirst / rate;
  if (std::isnan(excess(h))) return std::numeric_limits<double>::quiet_NaN();
  while (excess(h) <= kSurelyAbove) {
    h *= kRatio;
    if (h * rate > kLast) return std::numeric_limits<double>::infinity();
  }
  // If growth only fades into rounding for smaller steps, no step is stable.
  if (h * rate <= kFirst || excess(h / 1.5) > kAbove) return 0;

  double stable = h / kRatio;
  while (h - stable > 1e-13 * h) {
    const double middle = 0.5 * (stable + h);
    (excess(middle) <= kAbove ? stable : h) = middle;
  }
  return stable;
}

double stable_step(const Integrator& integrator, double omega, double gamma) {
  return stable_step(
      [&](double h_omega, double h_gamma) { return integrator.amplification(h_omega, h_gamma); },
      omega, gamma);
}

}  // namespace sim
