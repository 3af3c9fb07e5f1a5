#include "core/study/limits/step_limit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/ode/stability.h"
#include "core/particles/particle_system.h"
#include "core/study/limits/disturbance.h"

namespace sim::study {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// The first step above `from` at which the radius leaves 1 + tolerance, to 1e-6.
double first_crossing(const std::function<double(double)>& radius, double from, double most,
                      double tolerance, double scan) {
  const auto stable = [&](double h) { return radius(h) <= 1 + tolerance; };
  if (!stable(from)) return 0;
  double low = from, high = from;
  do {
    low = high;
    high = low * scan;
    if (high > most) return kUnlimited;
  } while (stable(high));
  while (high - low > 1e-6 * low) {
    const double middle = 0.5 * (low + high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

using Matrix2 = std::array<std::array<double, 2>, 2>;

// a^-1 b.
Matrix2 solved(const Matrix2& a, const Matrix2& b) {
  const double det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
  Matrix2 x;
  for (std::size_t j = 0; j < 2; ++j) {
    x[0][j] = (a[1][1] * b[0][j] - a[0][1] * b[1][j]) / det;
    x[1][j] = (a[0][0] * b[1][j] - a[1][0] * b[0][j]) / det;
  }
  return x;
}

// The spectral radius of x -> a x in two dimensions. Near the double eigenvalue of a very short
// step, rounding would appear as its square root: such a close pair is taken as complex.
double spectral_radius(const Matrix2& a, double tolerance) {
  const double half = 0.5 * (a[0][0] + a[1][1]), det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
  const double square = half * half - det;
  if (!(square >= tolerance))
    return std::sqrt(std::abs(det));  // also nan, for a matrix that is not finite
  return std::abs(half) + std::sqrt(square);
}

double largest_number(std::span<const double> values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

double shortest_spring(const Simulation& system) {
  double least = kUnlimited;
  for (int i = 0; i < system.particles() && system.second_order(); ++i)
    for (const Link& link : system.links(i)) {
      const double length = (system.position(i) - system.position(link.to)).stableNorm();
      for (const double candidate : {length, link.rest})
        if (candidate > 0) least = std::min(least, candidate);
    }
  return least;
}

}  // namespace

double largest_stable_step(const std::function<double(double h)>& radius, double rate,
                           double damping, double tolerance, double scan) {
  constexpr double kLeast = 1e-3, kMost = 1e3;  // in units of 1 / rate
  if (!(rate > 0)) return kUnlimited;
  // An explicit method without stability of its own relies on damping: Euler has h =
  // damping/rate^2.
  const double help = damping > 0 ? std::clamp(damping / rate, 1e-6, 1.0) : 1.0;
  const double from = kLeast * help / rate, most = kMost / rate;
  const double limit = first_crossing(radius, from, most, tolerance, scan);
  if (limit == 0 || limit == kUnlimited) return limit;
  // Growth from the smallest steps on, too slow to be seen there, moves with the tolerance.
  const double looser = first_crossing(radius, from, most, 4 * tolerance, scan);
  return looser > 1.1 * limit ? 0 : limit;
}

StepShare step_share(const Integrator& integrator, const Vibration& mode, double h) {
  constexpr double kAbove = 1 + 1e-12, kFactor = 1.1;
  const auto radius = [&](double s) {
    return integrator.amplification(s * h * mode.omega, s * h * mode.damping);
  };
  const double now = radius(1);
  if (std::isnan(now)) return {now, now};
  double stable = 1, unstable = 1;
  if (now <= kAbove) {
    while (radius(unstable) <= kAbove) {
      stable = unstable;
      unstable *= kFactor;
      if (unstable > 1e3) return {0, now};
    }
  } else {
    while (!(radius(stable) <= kAbove)) {
      unstable = stable;
      stable /= kFactor;
      if (stable < 1e-4) return {kUnlimited, now};
    }
  }
  while (unstable - stable > 1e-3 * stable) {
    const double middle = 0.5 * (stable + unstable);
    (radius(middle) <= kAbove ? stable : unstable) = middle;
  }
  return {1 / stable, now};
}

// 1 - z + z^2 / 2| <= 1 for z = tau decay <= 2; verlet makes two kicks of h / 2.
double kick_limit(const IntegratorInfo& info, double decay) {
  return decay > 0 ? (info.order > 1 ? 4 : 2) / decay : kUnlimited;
}

std::optional<double> predicted_step(const Integrator& integrator, const Spectrum& spectrum) {
  if (std::isnan(integrator.amplification(0.1, 0))) return {};
  double limit = kUnlimited;
  bool grows = false, moves = false;
  Vibration last{-1, -1};
  // Splittings take drag exactly, whatever the mode; the others see only X' = f.
  const bool splits = integrator.info().needs_second_order;
  for (const Vibration& mode : splits ? spectrum.vibrations : spectrum.rates) {
    if (mode.omega == last.omega && mode.damping == last.damping) continue;
    last = mode;
    // A vibration that grows only by rounding has damping 0.
    const bool itself = mode.damping < -1e-9 * mode.omega;
    (itself ? grows : moves) |= mode.omega > 0;
    if (itself) continue;
    limit = std::min(limit, stable_step(integrator, mode.omega, std::max(mode.damping, 0.0)));
  }
  if (splits) limit = std::min(limit, kick_limit(integrator.info(), spectrum.velocities.forces));
  if (grows && !moves) return {};
  return limit;
}

Standstill::Standstill(const Problem& problem, Simulation& system)
    : spec_(*problem.spec), problem_(problem), t_(system.t()), x_(system.state().size()) {
  std::ranges::copy(system.state(), x_.data());
  if (const ParticleSystem* particles = particles_of(system)) {
    const StatePart& velocity = *system.shape().find("velocity");
    for (std::size_t i = 0; i < velocity.count; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) x_[velocity.at(i, axis)] = 0;
    Array point(x_.size()), rate(x_.size());
    system.ode().eval(t_, {x_.data(), {}}, point.data(), rate.data());
    const ParticleView view = particles->view(t_, x_.data());
    if (spec_.loads.empty()) spec_.loads.assign(static_cast<std::size_t>(view.n), Vec3::Zero());
    for (int i = 0; i < view.n; ++i)
      for (int axis = 0; axis < 3 && view.free(i); ++axis)
        spec_.loads[static_cast<std::size_t>(i)][axis] -=
            view.mass[i] *
            rate[velocity.at(static_cast<std::size_t>(i), static_cast<std::size_t>(axis))];
  }
  problem_.spec = &spec_;
  // The integrator of the run or, if it accepts no loads, any other.
  std::vector<MethodChoice> choices{problem_.integrator()};
  for (std::string& name : problem_.registry->names<Integrator>())
    choices.push_back({std::move(name)});
  for (const MethodChoice& choice : choices) {
    try {
      system_.emplace(problem_.with(choice).simulation());
      return;
    } catch (const Error&) {
      if (&choice == &choices.back()) throw;
    }
  }
}

MeasuredRadius::MeasuredRadius(Standstill& place, const Spectrum& spectrum,
                               const MethodChoice& method)
    : place_(&place),
      spectrum_(&spectrum),
      map_(place.system().ode(), place.problem().with(method).make_integrator()),
      x_(place.state().size()),
      above_(x_.size()),
      below_(x_.size()) {
  constexpr double kDisturbance = 1e-5, kRounding = 1e-15, kSolver = 1e-3;
  map_.set_step_size(place.system().h());
  const double size_of_x = largest_number(place.state());
  double scale = std::min(shortest_spring(place.system()), std::max(size_of_x, 1e-300));
  if (scale == 0) scale = 1;
  size_ = kDisturbance * scale;
  tolerance_ = std::max(4e-9, kRounding * size_of_x / size_);
  if (map_.integrator().info().implicit) tolerance_ = std::max(tolerance_, kSolver);
}

double MeasuredRadius::operator()(double h) {
  if (place_->system().ode().stopped()) return kUnlimited;
  const std::span<const double> state = place_->state();
  const std::vector<double>* const basis[2] = {&spectrum_->shape, &spectrum_->partner};
  const auto inner = [&](const auto& a, const auto& b) {
    double sum = 0;
    for (std::size_t i = 0; i < state.size(); ++i) sum += spectrum_->weights[i] * a[i] * b[i];
    return sum;
  };
  const auto step_from = [&](double sign, const std::vector<double>& direction, Array& out) {
    for (std::size_t i = 0; i < state.size(); ++i) x_[i] = state[i] + sign * size_ * direction[i];
    return map_.step(place_->t(), h, x_.data(), out.data());
  };
  // Column j: the step's derivative along basis j, in coordinates of the basis.
  Matrix2 gram, moved;
  for (std::size_t j = 0; j < 2; ++j) {
    if (!step_from(1, *basis[j], above_) || !step_from(-1, *basis[j], below_)) return kUnlimited;
    for (std::size_t i = 0; i < state.size(); ++i)
      above_[i] = (above_[i] - below_[i]) / (2 * size_);
    for (std::size_t i = 0; i < 2; ++i) {
      gram[i][j] = inner(*basis[i], *basis[j]);
      moved[i][j] = inner(*basis[i], above_);
    }
  }
  if (!(gram[1][1] > 0)) return std::abs(moved[0][0] / gram[0][0]);  // a real eigenvalue
  const double radius = spectral_radius(solved(gram, moved), tolerance_);
  return std::isnan(radius) ? kUnlimited : radius;
}

// Single steps in the plane of the fastest mode determine its limit to many digits; a random
// disturbance shows the other modes. For methods of several steps there is that alone.
std::optional<double> measured_step(Standstill& place, const Spectrum& spectrum,
                                    const MethodChoice& method) {
  constexpr double kFineScan = 1.05, kCoarseScan = 1.3;
  if (!(spectrum.fastest.omega > 0)) return {};
  const bool second = place.system().second_order();
  double rate = spectrum.fastest.omega;
  for (const Vibration& each : spectrum.rates) rate = std::max(rate, each.omega);
  MeasuredRadius radius(place, spectrum, method);
  std::optional<Disturbance> growth;
  if (second && !radius.implicit()) growth.emplace(place, spectrum, method);
  if (growth && growth->keeps_steps())
    return largest_stable_step([&](double h) { return (*growth)(h); }, rate,
                               spectrum.fastest.damping, growth->tolerance(), kCoarseScan);
  const double limit = largest_stable_step(
      [&](double h) { return radius(h); }, spectrum.fastest.omega, spectrum.fastest.damping,
      radius.tolerance(), radius.implicit() ? kCoarseScan : kFineScan);
  return growth ? limit_by_disturbance(*growth, limit) : limit;
}

}  // namespace sim::study
