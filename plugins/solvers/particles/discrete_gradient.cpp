#include "discrete_gradient.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/slot.h"

namespace sim {
namespace {

constexpr int kMostHalves = 12;  // a step is divided into 2^12 parts at most
constexpr int kMostNewton = 20;  // iterations, more than most steps take
constexpr int kLast = 3;         // residuals, whose largest a step need not lower further
constexpr int kShorter = 10;     // trials of a line search, each half of the last
constexpr double kFall = 1e-4;   // of the residual, that a share of a step has to reach
// A residual g changes the energy by 2 v.g in a step: it falls to this share of |v|, or to more
// where roundings stop it.
constexpr double kPart = 1e-9, kStuck = 1e3;

// The ringing of a seam in a cloth that folds does not grow with this; 2 / (h omega) is critical.
double damping_of(double h_omega) {
  constexpr double kResolved = 10, kGrowth = 6e-6;
  const double beyond = std::max(0.0, h_omega - kResolved);
  return std::min(2 / h_omega, kGrowth * beyond * beyond);
}

PivotedBlockLu make_matrix(const Particles& system, std::vector<int>& rows) {
  std::vector<std::array<int, 2>> pairs;
  for (const Force* const force : system.forces())
    if (const Springs* const springs = force->springs())
      springs->for_each([&](int a, int b, double, double) { pairs.push_back({a, b}); });
  rows = elimination_rows(system.masses(), pairs);
  return PivotedBlockLu(rows, pairs);
}

}  // namespace

DiscreteGradientSolver::DiscreteGradientSolver(const Particles& system, double tolerance,
                                               std::function<bool()> stopped)
    : tolerance_(tolerance),
      stopped_(std::move(stopped)),
      layout_(system.layout()),
      matrix_({}, {}) {
  std::vector<int> place;
  matrix_ = make_matrix(system, place);
  const int n = layout_.n();
  free_ = slot(matrix_.size());
  id_.resize(slot(n));
  int fixed = matrix_.size();
  for (int i = 0; i < n; ++i) {
    if (place[slot(i)] < 0) place[slot(i)] = fixed++;
    id_[slot(place[slot(i)])] = i;
  }
  for (const int i : id_) mass_.push_back(system.masses()[slot(i)]);
  stiffness_.resize(free_);
  for (const Force* const force : system.forces()) {
    if (!force->springs()) continue;
    force->springs()->for_each([&](int a, int b, double k, double rest) {
      Spring spring{.a = place[slot(a)],
                    .b = place[slot(b)],
                    .k = k,
                    .rest = rest,
                    .omega = std::sqrt(
                        k * (1 / mass_[slot(place[slot(a)])] + 1 / mass_[slot(place[slot(b)])])),
                    .sense = force->springs()->sense()};
      const auto [low, high] = std::minmax(spring.a, spring.b);
      if (slot(high) < free_) spring.pair = matrix_.pair(low, high);
      for (const int end : {spring.a, spring.b})
        if (slot(end) < free_) stiffness_[slot(end)] += k;
      springs_.push_back(spring);
    });
  }
  for (std::vector<Vec3>* list : {&q_, &v_, &middle_, &trial_, &g_, &d_}) list->resize(slot(n));
}

StepStatus DiscreteGradientSolver::step(double h, double* x) {
  const auto q = layout_.axes(x), v = layout_.axes(x, 3);
  for (std::size_t i = 0; i < id_.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      q_[i][axis] = q[axis][id_[i]];
      v_[i][axis] = v[axis][id_[i]];
    }
  const StepStatus status = halve(h, 0);
  for (std::size_t i = 0; i < id_.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      q[axis][id_[i]] = q_[i][axis];
      v[axis][id_[i]] = v_[i][axis];
    }
  return status;
}

StepStatus DiscreteGradientSolver::halve(double h, int depth) {
  const StepStatus status = solve(h);
  if (status == StepStatus::kDone) {
    for (std::size_t i = 0; i < id_.size(); ++i) {
      q_[i] += h * middle_[i];
      v_[i] = 2 * middle_[i] - v_[i];
    }
    return status;
  }
  if (status == StepStatus::kStopped || depth == kMostHalves) return status;
  const StepStatus first = halve(0.5 * h, depth + 1);
  return first == StepStatus::kDone ? halve(0.5 * h, depth + 1) : first;
}

// Newton's method. The matrix has the tensions that follow to first order from the last iterate,
// as if they were unknowns of their own: the springs then may be as stiff as rods. A step that
// turns stiff springs raises the residual before the next lowers it, so that the line search
// compares with the largest of a few (Grippo, Lampariello & Lucidi (1986), SIAM J. Numer. Anal. 23,
// 707-716).
StepStatus DiscreteGradientSolver::solve(double h) {
  begin(h);
  double now = evaluate(h);
  const double first = now, least = rounding(h);
  bool stuck = false;
  std::array<double, kLast> last{};
  for (int n = 0; n <= kMostNewton; ++n) {
    if (!std::isfinite(now)) return StepStatus::kNotFinite;
    const double goal = std::max(tolerance_ > 0 ? tolerance_ * first : kPart * speed(), least);
    if (now <= (stuck ? kStuck : 1) * goal) {
      if (first > 0) effort_.residual = std::max(effort_.residual, now / first);
      return StepStatus::kDone;
    }
    if (stopped_ && stopped_()) return StepStatus::kStopped;
    if (n == kMostNewton || stuck) break;
    ++effort_.newton;
    ++effort_.factorisations;
    assemble(h, n == 0);
    if (!matrix_.factorise()) break;
    for (std::size_t i = 0; i < free_; ++i) d_[i] = -g_[i];
    matrix_.solve({d_.data(), free_});
    for (Spring& spring : springs_)
      spring.predicted = spring.alpha + spring.slope.dot(d_[slot(spring.a)] - d_[slot(spring.b)]);
    double before = 0;
    last[slot(n % kLast)] = now;
    for (const double residual : last) before = std::max(before, residual);
    std::copy_n(middle_.begin(), free_, trial_.begin());
    double share = 1;
    stuck = true;
    for (int trial = 0; trial < kShorter && stuck; ++trial, share *= 0.5) {
      for (std::size_t i = 0; i < free_; ++i) middle_[i] = trial_[i] + share * d_[i];
      now = evaluate(h);
      stuck = !(now <= (1 - kFall * share) * before);
    }
  }
  return StepStatus::kNotConverged;
}

void DiscreteGradientSolver::begin(double h) {
  std::ranges::copy(v_, middle_.begin());
  for (Spring& spring : springs_) {
    spring.start = q_[slot(spring.a)] - q_[slot(spring.b)];
    spring.start_length = length(spring.start);
    spring.damping = damping_of(h * spring.omega);
  }
}

// g = m (v_middle - v) - h/2 F, in the norm of 1/m.
double DiscreteGradientSolver::evaluate(double h) {
  for (std::size_t i = 0; i < free_; ++i) g_[i] = mass_[i] * (middle_[i] - v_[i]);
  for (Spring& spring : springs_) {
    const Vec3 change = middle_[slot(spring.a)] - middle_[slot(spring.b)];
    const Vec3 end = spring.start + h * change;
    const double l0 = spring.start_length, l1 = length(end), sum = l0 + l1;
    const bool acted = !slack(spring.sense, l0, spring.rest);
    const bool acts = !slack(spring.sense, l1, spring.rest);
    double slope = 0;  // of alpha against l1
    spring.alpha = 0;
    if (spring.rest == 0) {
      // A cable without a length is always taut.
      spring.alpha = acted || acts ? 1 : 0;
    } else if (acted && acts && sum > 0) {
      const double damped = spring.rest - spring.damping * (l1 - l0);
      spring.alpha = 1 - 2 * damped / sum;
      slope = 2 * (spring.damping + damped / sum) / sum;
    } else if ((acted || acts) && l1 != l0 && sum > 0) {
      const double now = acts ? l1 - spring.rest : 0, before = acted ? l0 - spring.rest : 0;
      const double ratio = (now * now - before * before) / (l1 - l0);
      spring.alpha = ratio / sum;
      slope = ((2 * now - ratio) / (l1 - l0) - spring.alpha) / sum;
    }
    spring.slope = l1 > 0 ? (slope * h / l1) * end : Vec3(0, 0, 0);
    const Vec3 push = 0.5 * h * spring.k * spring.alpha * (spring.start + 0.5 * h * change);
    if (slot(spring.a) < free_) g_[slot(spring.a)] += push;
    if (slot(spring.b) < free_) g_[slot(spring.b)] -= push;
  }
  double square = 0;
  for (std::size_t i = 0; i < free_; ++i) square += g_[i].squaredNorm() / mass_[i];
  return std::sqrt(square);
}

void DiscreteGradientSolver::assemble(double h, bool first) {
  matrix_.clear();
  for (std::size_t i = 0; i < free_; ++i)
    matrix_.diagonal(static_cast<int>(i)) = Mat3::Diagonal({mass_[i], mass_[i], mass_[i]});
  for (const Spring& spring : springs_) {
    const Vec3 middle =
        spring.start + 0.5 * h * (middle_[slot(spring.a)] - middle_[slot(spring.b)]);
    const double along = 0.5 * h * (first ? spring.alpha : spring.predicted);
    const Mat3 block =
        0.5 * h * spring.k * (Mat3::Diagonal({along, along, along}) + outer(middle, spring.slope));
    if (slot(spring.a) < free_) matrix_.diagonal(spring.a) += block;
    if (slot(spring.b) < free_) matrix_.diagonal(spring.b) += block;
    if (spring.pair < 0) continue;
    matrix_.upper(spring.pair) -= block;
    matrix_.lower(spring.pair) -= block;
  }
}

double DiscreteGradientSolver::speed() const {
  double square = 0;
  for (std::size_t i = 0; i < free_; ++i) square += mass_[i] * middle_[i].squaredNorm();
  return std::sqrt(square);
}

// The norm of the rounding errors of g: those of positions in the forces, and of velocities.
double DiscreteGradientSolver::rounding(double h) const {
  double square = 0;
  for (std::size_t i = 0; i < free_; ++i) {
    const double size = 0.5 * h * stiffness_[i] * q_[i].norm() + mass_[i] * v_[i].norm();
    square += size * size / mass_[i];
  }
  return 4 * std::numeric_limits<double>::epsilon() * std::sqrt(square);
}

}  // namespace sim
