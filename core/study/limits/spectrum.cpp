#include "core/study/limits/spectrum.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <map>

#include "core/base/array.h"
#include "core/base/noise.h"
#include "core/particles/springs/springs.h"

namespace sim::study {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

// The numbers of X that are free to move, each with the square root of its mass. In a system of
// particles those are positions; the velocity of one stands `to_velocity` further on.
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
  auto size() const { return static_cast<Eigen::Index>(where_.at.size()); }

  bool second_order() const { return where_.to_velocity > 0; }

  void apply(const VectorXd& u, VectorXd& y) {
    product(u, 0);
    y.resize(size());
    for (Eigen::Index i = 0; i < size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double df = df_[where_.at[k] + where_.to_velocity];
      y[i] = second_order() ? -where_.root_mass[k] * df : df;
    }
  }

  // u^T C u of the damping a = -C v in a system of particles.
  double damping(const VectorXd& u) {
    product(u, where_.to_velocity);
    double sum = 0;
    for (Eigen::Index i = 0; i < size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      sum -= u[i] * where_.root_mass[k] * df_[where_.at[k] + where_.to_velocity];
    }
    return sum / u.squaredNorm();
  }

 private:
  // df := J dx, dx = M^-1/2 u in the positions, or `shift` further on.
  void product(const VectorXd& u, std::size_t shift) {
    for (Eigen::Index i = 0; i < size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      dx_[where_.at[k] + shift] = u[i] / where_.root_mass[k];
    }
    jacobian_->apply(dx_.data(), df_.data());
    for (const std::size_t i : where_.at) dx_[i + shift] = 0;
  }

  Coordinates where_;
  std::unique_ptr<Jacobian> jacobian_;
  Array dx_, df_;
};

// Neighbours against each other, as stiff modes are, and a little of everything else.
VectorXd start_vector(Eigen::Index size) {
  VectorXd u(size);
  Noise noise;
  for (Eigen::Index i = 0; i < size; ++i) u[i] = (i % 2 == 0 ? 1 : -1) + noise.next();
  return u.normalized();
}

struct Ritz {
  VectorXcd values;               // of S, in no order
  Eigen::MatrixXcd coefficients;  // of the vectors in the basis
  MatrixXd basis;
  double next = 0;  // norm of what the basis misses
  int products = 0;
};

// The eigenpairs of H = Q^T S Q. When S is symmetric so is H, but for rounding.
void solve(const MatrixXd& h, Ritz& ritz) {
  const MatrixXd transposed = h.transpose();
  if ((h - transposed).norm() <= 1e-6 * h.norm()) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(0.5 * (h + transposed));
    ritz.values = solver.eigenvalues().cast<Complex>();
    ritz.coefficients = solver.eigenvectors().cast<Complex>();
  } else {
    const Eigen::EigenSolver<MatrixXd> solver(h);
    ritz.values = solver.eigenvalues();
    ritz.coefficients = solver.eigenvectors();
  }
}

// The fastest vibration: of S in a system of particles omega^2 = value, negative ones grow instead.
Eigen::Index fastest(const VectorXcd& values, bool second_order) {
  Eigen::Index best = 0;
  if (second_order)
    values.real().maxCoeff(&best);
  else
    values.cwiseAbs().maxCoeff(&best);
  return best;
}

// S Q_k = Q_k H_k + h_k+1 q_k+1 e_k^T, until the fastest vibration is known to 1e-7 or the space is
// used up.
Ritz arnoldi(Action& action, int most) {
  constexpr double kTolerance = 1e-7;
  constexpr double kMostNumbers = 3e7;  // of the basis: 240 MB
  const Eigen::Index n = action.size();
  const auto room = static_cast<Eigen::Index>(kMostNumbers / static_cast<double>(n));
  const Eigen::Index length = std::min<Eigen::Index>({most, n, std::max<Eigen::Index>(room, 4)});
  Ritz ritz;
  ritz.basis.resize(n, length + 1);
  MatrixXd h = MatrixXd::Zero(length + 1, length);
  ritz.basis.col(0) = start_vector(n);
  VectorXd y;
  Eigen::Index k = 0;
  while (k < length) {
    action.apply(ritz.basis.col(k), y);
    ++ritz.products;
    if (!y.allFinite()) break;
    const double size = y.norm();
    for (int pass = 0; pass < 2; ++pass) {  // twice is enough (Parlett 1980)
      const VectorXd part = ritz.basis.leftCols(k + 1).transpose() * y;
      y -= ritz.basis.leftCols(k + 1) * part;
      h.col(k).head(k + 1) += part;
    }
    ritz.next = y.norm();
    h(k + 1, k) = ritz.next;
    ++k;
    const bool closed = ritz.next <= 1e-12 * std::max(size, h.cwiseAbs().maxCoeff());
    if (!closed) ritz.basis.col(k) = y / ritz.next;
    if (!closed && k < length && k % 5 != 0) continue;
    solve(h.topLeftCorner(k, k), ritz);
    const Eigen::Index i = fastest(ritz.values, action.second_order());
    if (closed) ritz.next = 0;
    if (ritz.next * std::abs(ritz.coefficients(k - 1, i)) <= kTolerance * std::abs(ritz.values[i]))
      break;
  }
  ritz.basis.conservativeResize(n, ritz.coefficients.rows());
  return ritz;
}

Vibration vibration(Complex value, bool second_order, double damping) {
  if (second_order) return {std::sqrt(std::max(value.real(), 0.0)), damping};
  return {std::abs(value), -2 * value.real()};
}

// Re lambda where it is positive: lambda^2 + damping lambda + value = 0 in a system of particles.
double growth(Complex value, bool second_order, double damping) {
  if (!second_order) return std::max(value.real(), 0.0);
  if (!(value.real() < 0)) return 0;
  return std::sqrt(damping * damping / 4 - value.real()) - damping / 2;
}

// The mode in the layout of X, as large as the coordinates of one particle can be.
void unfold(const Simulation& system, const Coordinates& where, const VectorXcd& u,
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
    most = std::max(most, std::abs(u[static_cast<Eigen::Index>(k)]) / where.root_mass[k]);
  for (std::size_t k = 0; k < where.at.size() && most > 0; ++k) {
    const Complex value = u[static_cast<Eigen::Index>(k)] / where.root_mass[k] / most;
    result.shape[where.at[k]] = value.real();
    if (second)
      result.partner[where.at[k] + where.to_velocity] = result.fastest.omega * value.real();
    else
      result.partner[where.at[k]] = value.imag();
  }
}

// Where the mode lives: its kinetic energy by particle, its elastic energy by family.
void locate(Simulation& system, const Coordinates& where, const VectorXcd& u, Spectrum& result) {
  constexpr std::size_t kParticles = 4;
  if (!system.second_order()) return;
  std::map<int, double> share;
  for (std::size_t k = 0; k < where.at.size(); ++k)
    share[where.particle[k]] += std::norm(u[static_cast<Eigen::Index>(k)]);
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
// direction: 1/2 k [(u.e)^2 + (1 - r/d) |e - u (u.e)|^2]. Springs that lost tension give less than
// 0.
std::vector<std::pair<std::string, double>> family_shares(const Simulation& system,
                                                          const std::vector<double>& displacement) {
  const auto moved = [&](int i) {
    return Eigen::Map<const Vec3>(&displacement[3 * static_cast<std::size_t>(i)]);
  };
  std::vector<std::pair<std::string, double>> shares;
  for (const auto& [family, count] : system.families()) shares.emplace_back(family, 0.0);
  double total = 0;
  for (int i = 0; i < system.particles(); ++i)
    for (const Link& link : system.links(i)) {
      if (link.to < i) continue;
      const Vec3 d = system.position(i) - system.position(link.to);
      const double length = d.stableNorm();
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
    if (!springs) return std::numeric_limits<double>::infinity();
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

Vibration fastest_vibration(Simulation& system, int products) {
  const bool second = system.second_order();
  Action action(system);
  if (action.size() == 0) return {};
  const Ritz ritz = arnoldi(action, products);
  if (ritz.values.size() == 0) return {std::nan(""), std::nan("")};
  const Eigen::Index first = fastest(ritz.values, second);
  const VectorXd u = (ritz.basis * ritz.coefficients.col(first)).real();
  return vibration(ritz.values[first], second, second ? action.damping(u) : 0);
}

Spectrum spectrum(Simulation& system, int products) {
  Spectrum result;
  result.bound = omega_bound(system);
  const bool second = system.second_order();
  Action action(system);
  if (action.size() == 0) return result;
  const Ritz ritz = arnoldi(action, products);
  result.products = ritz.products;
  if (ritz.values.size() == 0) {
    result.fastest.omega = result.residual = std::nan("");
    return result;
  }
  const Eigen::Index first = fastest(ritz.values, second);
  const VectorXcd u = ritz.basis * ritz.coefficients.col(first);
  const double damping = second ? action.damping(u.real()) : 0;
  for (const Complex value : ritz.values) {
    const Vibration found = vibration(value, second, damping);
    result.vibrations.push_back(found);
    result.growth = std::max(result.growth, growth(value, second, damping));
  }
  std::stable_sort(result.vibrations.begin(), result.vibrations.end(),
                   [](const Vibration& a, const Vibration& b) { return a.omega > b.omega; });
  result.fastest = result.vibrations.front();
  const double size = std::abs(ritz.values[first]);
  result.residual =
      size > 0 ? ritz.next * std::abs(ritz.coefficients(ritz.coefficients.rows() - 1, first)) / size
               : 0;
  unfold(system, action.where(), u, result);
  locate(system, action.where(), u, result);
  return result;
}

}  // namespace sim::study
