#include "core/study/limits/spectrum.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <map>

#include "core/base/array.h"
#include "core/base/noise.h"
#include "core/math/arnoldi.h"
#include "core/ode/fastest_mode.h"
#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"

namespace sim::study {
namespace {

using Complex = std::complex<double>;

// The numbers of X that are free to move, each with the square root of its mass. In a system of
// particles those are positions; the velocity of one is `to_velocity` further on.
struct Coordinates {
  std::vector<std::size_t> at;
  std::vector<int> particle;  // whose they are, in a system of particles
  std::vector<double> root_mass;
  std::size_t to_velocity = 0;

  explicit Coordinates(Simulation& system) {
    const ParticleSystem* particles = particles_of(system);
    if (!particles) {
      at.resize(system.ode().size());
      for (std::size_t i = 0; i < at.size(); ++i) at[i] = i;
      root_mass.assign(at.size(), 1.0);
      return;
    }
    const StatePart& position = *system.shape().find("position");
    const StatePart& velocity = *system.shape().find("velocity");
    const ParticleView view = particles->view(system.t(), system.state().data());
    to_velocity = velocity.begin - position.begin;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < view.n; ++i) {
        if (!view.free(i)) continue;
        at.push_back(position.at(static_cast<std::size_t>(i), static_cast<std::size_t>(axis)));
        particle.push_back(i);
        root_mass.push_back(std::sqrt(view.mass[i]));
      }
  }
};

// A start vector with neighbours in opposite directions, as in stiff modes, and some noise.
std::vector<double> start_vector(std::size_t size) {
  std::vector<double> u(size);
  Noise noise;
  for (std::size_t i = 0; i < size; ++i) u[i] = (i % 2 == 0 ? 1 : -1) + noise.next();
  return u;
}

// y = S u. Particles: S = -M^1/2 (da/dq) M^-1/2, whose eigenvalues are omega^2. Others: S = J.
class Action {
 public:
  explicit Action(Simulation& system)
      : where_(system),
        jacobian_(system.ode().jacobian()),
        dx_(system.ode().size()),
        df_(system.ode().size()) {
    jacobian_->at(system.t(), system.state().data());
  }

  const Coordinates& where() const { return where_; }
  std::size_t size() const { return where_.at.size(); }

  bool second_order() const { return where_.to_velocity > 0; }

  void apply(const double* u, double* y) {
    product(u, 0);
    for (std::size_t k = 0; k < size(); ++k) {
      const double df = df_[where_.at[k] + where_.to_velocity];
      y[k] = second_order() ? -where_.root_mass[k] * df : df;
    }
  }

  // y = -M^1/2 (da/dv) M^-1/2 u of a system of particles.
  void damp(const double* u, double* y) {
    product(u, where_.to_velocity);
    for (std::size_t k = 0; k < size(); ++k)
      y[k] = -where_.root_mass[k] * df_[where_.at[k] + where_.to_velocity];
  }

  // y = J u of the whole state, u = (M^1/2 q, M^1/2 v / rate): with the rate of the fastest mode
  // both halves are of one size.
  void apply_whole(const double* u, double* y, double rate) {
    const std::size_t n = size(), shift = where_.to_velocity;
    for (std::size_t k = 0; k < n; ++k) {
      dx_[where_.at[k]] = u[k] / where_.root_mass[k];
      dx_[where_.at[k] + shift] = rate * u[n + k] / where_.root_mass[k];
    }
    jacobian_->apply(dx_.data(), df_.data());
    for (std::size_t k = 0; k < n; ++k) {
      y[k] = where_.root_mass[k] * df_[where_.at[k]];
      y[n + k] = where_.root_mass[k] * df_[where_.at[k] + shift] / rate;
      dx_[where_.at[k]] = dx_[where_.at[k] + shift] = 0;
    }
  }

  // True if the damping is the same for every motion.
  bool evenly_damped() {
    constexpr double kSame = 1e-9;
    std::vector<double> u = start_vector(size());
    product(u.data(), where_.to_velocity);
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (std::size_t k = 0; k < size(); ++k) {
      const double rate = -where_.root_mass[k] * df_[where_.at[k] + where_.to_velocity] / u[k];
      least = std::min(least, rate);
      most = std::max(most, rate);
    }
    return most - least <= kSame * std::max(std::abs(most), std::abs(least));
  }

  // u^T C u / u^T u of the damping a = -C v in a system of particles, for the real part of u.
  double damping(const std::vector<Complex>& u) {
    std::vector<double> direction(size());
    for (std::size_t k = 0; k < size(); ++k) direction[k] = u[k].real();
    product(direction.data(), where_.to_velocity);
    double sum = 0, squared = 0;
    for (std::size_t k = 0; k < size(); ++k) {
      sum -= direction[k] * where_.root_mass[k] * df_[where_.at[k] + where_.to_velocity];
      squared += direction[k] * direction[k];
    }
    return sum / squared;
  }

 private:
  // df := J dx, dx = M^-1/2 u in the positions, or `shift` further on.
  void product(const double* u, std::size_t shift) {
    for (std::size_t k = 0; k < size(); ++k) dx_[where_.at[k] + shift] = u[k] / where_.root_mass[k];
    jacobian_->apply(dx_.data(), df_.data());
    for (const std::size_t i : where_.at) dx_[i + shift] = 0;
  }

  Coordinates where_;
  std::unique_ptr<Jacobian> jacobian_;
  Array dx_, df_;
};

// The fastest vibration: of S in a system of particles omega^2 = value, negative ones grow instead.
std::size_t fastest(const std::vector<Complex>& values, bool second_order) {
  const auto rate = [&](Complex value) { return second_order ? value.real() : std::abs(value); };
  std::size_t best = 0;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (rate(values[i]) > rate(values[best])) best = i;
  return best;
}

struct Ritz {
  RitzPairs pairs;
  std::size_t first = 0;        // the fastest of them
  std::vector<Complex> vector;  // of the fastest
  double residual = 0;          // of the fastest, relative
  int products = 0;
};

// Expands the Krylov space until the fastest vibration is known to 1e-7, or the space is exhausted.
// No pairs if the first product is not finite.
Ritz fastest_pairs(Action& action, int most) {
  constexpr double kTolerance = 1e-7;
  constexpr double kMostNumbers = 3e7;  // of the basis: 240 MB
  const double room = kMostNumbers / static_cast<double>(action.size());
  Arnoldi arnoldi([&](const double* u, double* y) { action.apply(u, y); },
                  start_vector(action.size()),
                  std::min(most, static_cast<int>(std::max(room, 4.0))));
  Ritz ritz;
  for (bool more = true; more && !(ritz.pairs.values.size() > 0 && ritz.residual <= kTolerance);) {
    for (int i = 0; i < 5 && more; ++i) more = arnoldi.extend();
    if (arnoldi.size() == 0) break;
    ritz.pairs = arnoldi.pairs();
    ritz.first = fastest(ritz.pairs.values, action.second_order());
    const double missed = arnoldi.rest() * std::abs(ritz.pairs.last(ritz.first));
    const double size = std::abs(ritz.pairs.values[ritz.first]);
    ritz.residual = missed > 0 ? missed / size : 0;
  }
  if (!ritz.pairs.values.empty()) ritz.vector = arnoldi.vector(ritz.pairs, ritz.first);
  ritz.products = arnoldi.products();
  return ritz;
}

Vibration vibration(Complex value, bool second_order, double damping) {
  if (second_order) return {std::sqrt(std::max(value.real(), 0.0)), damping};
  return {std::abs(value), -2 * value.real()};
}

// The eigenvalues of J itself, if damping differs from mode to mode: all of a small system; of a
// large one the extreme ones that are known to 1e-3.
std::vector<Vibration> eigenvalues(Action& action, double omega) {
  constexpr int kWhole = 400, kRim = 160;
  constexpr double kKnown = 1e-3;
  const std::size_t numbers = 2 * action.size();
  const double rate = omega > 0 ? omega : 1;
  Arnoldi arnoldi([&](const double* u, double* y) { action.apply_whole(u, y, rate); },
                  start_vector(numbers), numbers <= kWhole ? static_cast<int>(numbers) : kRim);
  while (arnoldi.extend()) {}
  if (arnoldi.size() == 0) return {};
  const RitzPairs pairs = arnoldi.pairs();
  const bool all = arnoldi.rest() == 0 || static_cast<std::size_t>(arnoldi.size()) == numbers;
  std::vector<Vibration> found;
  for (std::size_t i = 0; i < pairs.values.size(); ++i) {
    const Complex value = pairs.values[i];
    const double missed = arnoldi.rest() * std::abs(pairs.last(i));
    if (all || missed <= kKnown * std::abs(value))
      found.push_back({std::abs(value), -2 * value.real()});
  }
  return found;
}

// Re lambda if it is positive: lambda^2 + damping lambda + value = 0 in a system of particles.
double growth(Complex value, bool second_order, double damping) {
  if (!second_order) return std::max(value.real(), 0.0);
  if (!(value.real() < 0)) return 0;
  return std::sqrt(damping * damping / 4 - value.real()) - damping / 2;
}

// The mode in the layout of X, normalised to the largest coordinates of one particle.
void unfold(const Simulation& system, const Coordinates& where, const std::vector<Complex>& u,
            Spectrum& result) {
  const bool second = where.to_velocity > 0;
  result.shape.assign(system.state().size(), 0.0);
  result.partner = result.weights = result.shape;
  for (std::size_t k = 0; k < where.at.size(); ++k) {
    const double mass = where.root_mass[k] * where.root_mass[k];
    result.weights[where.at[k]] = result.weights[where.at[k] + where.to_velocity] = mass;
  }
  double most = 0;
  for (std::size_t k = 0; k < where.at.size(); ++k)
    most = std::max(most, std::abs(u[k]) / where.root_mass[k]);
  for (std::size_t k = 0; k < where.at.size() && most > 0; ++k) {
    const Complex value = u[k] / where.root_mass[k] / most;
    result.shape[where.at[k]] = value.real();
    if (second)
      result.partner[where.at[k] + where.to_velocity] = result.fastest.omega * value.real();
    else
      result.partner[where.at[k]] = value.imag();
  }
}

// Locates the mode: its kinetic energy by particle, its elastic energy by family.
void locate(Simulation& system, const Coordinates& where, const std::vector<Complex>& u,
            Spectrum& result) {
  constexpr std::size_t kParticles = 4;
  if (!system.second_order()) return;
  std::map<int, double> share;
  for (std::size_t k = 0; k < where.at.size(); ++k) share[where.particle[k]] += std::norm(u[k]);
  result.particles.assign(share.begin(), share.end());
  std::stable_sort(result.particles.begin(), result.particles.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  if (result.particles.size() > kParticles) result.particles.resize(kParticles);

  const StatePart& position = *system.shape().find("position");
  std::vector<double> displacement(3 * position.count);
  for (std::size_t i = 0; i < position.count; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      displacement[3 * i + axis] = result.shape[position.at(i, axis)];
  result.families = family_shares(system, displacement);
}

}  // namespace

// The energy of a small displacement of a spring, e the relative displacement of its ends and u its
// direction: 1/2 k [(u.e)^2 + (1 - r/d) |e - u (u.e)|^2]. Springs that lost tension contribute less
// than 0.
std::vector<std::pair<std::string, double>> family_shares(const Simulation& system,
                                                          const std::vector<double>& displacement) {
  const auto moved = [&](int i) {
    const double* const at = &displacement[3 * static_cast<std::size_t>(i)];
    return Vec3(at[0], at[1], at[2]);
  };
  std::vector<std::pair<std::string, double>> shares;
  for (const auto& [family, count] : system.families()) shares.emplace_back(family, 0.0);
  double total = 0;
  for (int i = 0; i < system.particles(); ++i)
    for (const Link& link : system.links(i)) {
      if (link.to < i) continue;
      const Vec3 d = system.position(i) - system.position(link.to);
      const double length = d.stableNorm();
      if (slack(link.sense, length, link.rest)) continue;
      const Vec3 e = moved(i) - moved(link.to);
      double energy = 0.5 * link.stiffness * e.squaredNorm();
      if (length > 0) {
        const double along = d.dot(e) / length;
        energy = 0.5 * link.stiffness *
                 (along * along + (1 - link.rest / length) * (e.squaredNorm() - along * along));
      }
      for (auto& [family, share] : shares)
        if (family == link.family) share += energy;
      total += energy;
    }
  for (auto& [family, share] : shares) share = total != 0 ? share / total : 0;
  std::stable_sort(shares.begin(), shares.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return shares;
}

// Row i of S has blocks of norm at most k_ij / m_i on the diagonal and k_ij / sqrt(m_i m_j) beside
// it, as |1 - r/d| <= 1 for d >= r/2. Feingold & Varga (1962), Pacific J. Math. 12, 1241-1250.
double omega_bound(Simulation& system) {
  const ParticleSystem* particles = particles_of(system);
  if (!particles) return std::numeric_limits<double>::infinity();
  const ParticleView view = particles->view(system.t(), system.state().data());
  std::vector<double> row(static_cast<std::size_t>(view.n), 0.0);
  for (const auto& force : particles->forces()) {
    if (force->affine()) continue;
    const Springs* springs = force->springs();
    if (!springs || force->accumulates()) return std::numeric_limits<double>::infinity();
    for (int i = 0; i < view.n; ++i) {
      if (!view.free(i)) continue;
      double& sum = row[static_cast<std::size_t>(i)];
      springs->at(i, [&](int j, double k, double /*rest*/) {
        sum += k / view.mass[i];
        if (view.free(j)) sum += k / std::sqrt(view.mass[i]) / std::sqrt(view.mass[j]);
      });
    }
  }
  double most = 0;
  for (const double sum : row) most = std::max(most, sum);
  return std::sqrt(most);
}

double smallest_damping(Simulation& system) {
  const ParticleSystem* particles = particles_of(system);
  if (!particles) return 0;
  const ParticleView view = particles->view(system.t(), system.state().data());
  double heaviest = 0;
  for (int i = 0; i < view.n; ++i)
    if (view.free(i)) heaviest = std::max(heaviest, view.mass[i]);
  return heaviest > 0 ? particles->motion().damping / heaviest : 0;
}

double inverse_mass(Simulation& system, int particle) {
  return 1 / particles_of(system)->masses()[static_cast<std::size_t>(particle)];
}

VelocityDecay velocity_decay(Simulation& system, int products) {
  const ParticleSystem* particles = particles_of(system);
  if (!particles) return {};
  const ParticleView view = particles->view(system.t(), system.state().data());
  double lightest = HUGE_VAL;
  for (int i = 0; i < view.n; ++i)
    if (view.free(i)) lightest = std::min(lightest, view.mass[i]);
  VelocityDecay decay{.drag = particles->motion().damping / lightest};
  const bool others = std::ranges::any_of(particles->forces(), [](const Force* force) {
    return !force->affine() && force->depends_on_velocity();
  });
  if (!others || std::isinf(lightest)) return decay;
  Action action(system);
  Arnoldi arnoldi([&](const double* u, double* y) { action.damp(u, y); },
                  start_vector(action.size()), products);
  while (arnoldi.extend()) {}
  for (const Complex value : arnoldi.values()) decay.forces = std::max(decay.forces, value.real());
  return decay;
}

Vibration fastest_vibration(Simulation& system, int products) {
  const bool second = system.second_order();
  Action action(system);
  if (action.size() == 0) return {};
  const Ritz ritz = fastest_pairs(action, products);
  if (ritz.pairs.values.empty()) return {std::nan(""), std::nan("")};
  return vibration(ritz.pairs.values[ritz.first], second, second ? action.damping(ritz.vector) : 0);
}

Vibration limiting_vibration(Simulation& system, int products) {
  OdeSystem* const part = system.integrator().limiting_part();
  if (!part) return fastest_vibration(system, products);
  const FastestMode mode = fastest_mode(*part, system.t(), system.state().data());
  return {mode.rate, std::max(0.0, mode.damping)};
}

Spectrum spectrum(Simulation& system, int products) {
  Spectrum result;
  result.bound = omega_bound(system);
  const bool second = system.second_order();
  result.first_order = !second;
  Action action(system);
  if (action.size() == 0) return result;
  const Ritz ritz = fastest_pairs(action, products);
  result.products = ritz.products;
  if (ritz.pairs.values.empty()) {
    result.fastest.omega = result.residual = std::nan("");
    return result;
  }
  const double damping = second ? action.damping(ritz.vector) : 0;
  result.velocities = velocity_decay(system, products);
  for (const Complex value : ritz.pairs.values) {
    const Vibration found = vibration(value, second, damping);
    result.vibrations.push_back(found);
    result.growth = std::max(result.growth, growth(value, second, damping));
  }
  std::stable_sort(result.vibrations.begin(), result.vibrations.end(),
                   [](const Vibration& a, const Vibration& b) { return a.omega > b.omega; });
  result.fastest = result.vibrations.front();
  result.rates = result.vibrations;
  if (second && !action.evenly_damped()) {
    result.rates = eigenvalues(action, result.fastest.omega);
    const auto fast = [&](const Vibration& each) {
      return each.omega > 0.9 * result.fastest.omega;
    };
    if (std::ranges::none_of(result.rates, fast)) result.rates.push_back(result.fastest);
  }
  for (const Vibration& rate : result.rates)
    result.decay = std::max(result.decay, 0.5 * rate.damping);
  result.residual = std::isfinite(ritz.residual) ? ritz.residual : 0;
  unfold(system, action.where(), ritz.vector, result);
  locate(system, action.where(), ritz.vector, result);
  return result;
}

std::vector<double> fastest_mode(Simulation& system) {
  const Spectrum found = spectrum(system);
  const StatePart& part = system.shape().first();
  std::vector<double> values;
  for (int i = 0; i < (system.flat() ? 1 : system.particles()); ++i) {
    double square = 0;
    for (std::size_t c = 0; c < part.components.size(); ++c)
      for (const std::vector<double>* side : {&found.shape, &found.partner}) {
        const std::size_t at = part.at(static_cast<std::size_t>(i), c);
        if (at < side->size() && (side == &found.shape || !system.second_order()))
          square += (*side)[at] * (*side)[at];
      }
    values.push_back(std::sqrt(square));
  }
  const double most = std::ranges::max(values);
  for (double& value : values) value = most > 0 ? value / most : 0;
  return values;
}

}  // namespace sim::study
