#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/particles/constraints/constraint_solver.h"

namespace sim {
namespace {

// Rounding error of phi, relative to the largest coordinate.
constexpr double kRoundings = 1e-15;
// Residual of phi, relative to the largest coordinate, that is accepted if iterations stall.
constexpr double kGoodEnough = 1e-10;
// A step that increases the residual so much is too long, and Levenberg's shifts.
constexpr double kTooLong = 2, kLeastShift = 1e-6, kMostShift = 0.1, kGrows = 10;

// The largest coordinate, m, now or after a drift d.
double size_of(const Constraints::Axes& q, const Constraints::Axes& v, double d, std::size_t n) {
  double most = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < n; ++i)
      most = std::max(most, std::fabs(q[axis][i]) + std::fabs(d * v[axis][i]));
  return most;
}

double largest_of(std::span<const double> values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::fabs(value));
  return most;
}

}  // namespace

ConstraintSolver::ConstraintSolver(const Constraints& constraints, ThreadPool* pool)
    : constraints_(&constraints),
      values_(constraints.rows()),
      other_(constraints.rows()),
      matrix_(constraints.structure()),
      lambda_(static_cast<std::size_t>(constraints.rows().rows())),
      rest_(lambda_.size()),
      trial_(3 * constraints.weights().size()),
      curvature_(constraints) {
  matrix_.share(pool);
  values_.share(pool);
  other_.share(pool);
}

bool ConstraintSolver::evaluate(double t, ParticleView like, const Axes& q, const Axes& v,
                                const double* memory, RowValues& values) {
  like.t = t;
  like.x = q[0], like.y = q[1], like.z = q[2];
  like.vx = v[0], like.vy = v[1], like.vz = v[2];
  return values.evaluate(like, memory) || fail(Failure::kNotFinite, values);
}

// Divergence from a finite residual `off`, m, means that the start was too far from the
// constraints.
bool ConstraintSolver::ran_away(double off, const RowValues& values) {
  fail(Failure::kNotFinite, values);
  if (!std::isfinite(off)) return false;
  if (!constraints_->rows().part_of(worst_).constraint->complaint().empty()) return false;
  failure_ = Failure::kTooFar;
  residual_ = off;
  return false;
}

bool ConstraintSolver::fail(Failure failure, const RowValues& values) {
  failure_ = failure;
  residual_ = 0;
  for (std::size_t r = 0; r < lambda_.size(); ++r) {
    const double phi = std::fabs(values.phi()[r]);
    if (phi <= residual_) continue;
    residual_ = phi;
    worst_ = static_cast<int>(r);
    if (std::isnan(phi)) break;
  }
  return false;
}

std::string ConstraintSolver::refusal() const {
  if (failure_ == Failure::kNone) return {};
  const RowList& list = constraints_->rows();
  const RowList::Part& part = list.part_of(worst_);
  const std::string who =
      "constraint '" + constraints_->title(part) + "', " + list.name(worst_) + ": ";
  if (failure_ == Failure::kNotFinite) {
    const std::string why = part.constraint->complaint();
    return who + (why.empty() ? "its equations are not finite" : why);
  }
  return who + "no allowed state is in reach, it is off by " + brief(residual_, 3) + " m";
}

bool ConstraintSolver::accelerate(const ParticleView& view, const double* memory, const Axes& a) {
  failure_ = Failure::kNone;
  if (!values_.evaluate(view, memory)) return fail(Failure::kNotFinite, values_);
  matrix_.factorise(values_.gradient(), constraints_->weights());
  values_.times(a.data(), lambda_.data());
  for (std::size_t r = 0; r < lambda_.size(); ++r) lambda_[r] = -lambda_[r] - values_.bias()[r];
  if (const double c = constraints_->feedback(); c > 0) {
    const double* const v[3] = {view.vx, view.vy, view.vz};
    values_.times(v, rest_.data());
    for (std::size_t r = 0; r < lambda_.size(); ++r)
      lambda_[r] -= 2 * c * (rest_[r] + values_.drive()[r]) + c * c * values_.phi()[r];
  }
  matrix_.solve(lambda_.data());
  values_.add_transposed(lambda_.data(), constraints_->weights().data(), a.data());
  return true;
}

// from -= W J^T A^-1 rest_
void ConstraintSolver::remove(std::span<const double> weights, const RowValues& values,
                              const Axes& from) {
  matrix_.solve(rest_.data());
  for (double& each : rest_) each = -each;
  values.add_transposed(rest_.data(), weights.data(), from.data());
}

// Newton iterations on J v + drive = 0. `exact`: the factors are those of `values`.
bool ConstraintSolver::project_velocities(std::span<const double> weights, const RowValues& values,
                                          const Axes& v, bool exact) {
  constexpr int kMost = 20;
  double before = HUGE_VAL;
  for (int turn = 0; turn < kMost; ++turn) {
    values.times(v.data(), rest_.data());
    for (std::size_t r = 0; r < rest_.size(); ++r) rest_[r] += values.drive()[r];
    const double now = largest_of(rest_);
    if (!std::isfinite(now)) return fail(Failure::kNotFinite, values);
    // A residual at rounding level ends the iteration; inexact factors are recomputed first.
    if (now == 0 || (turn > 0 && !(now < 0.1 * before))) {
      if (exact || !(now > 1e-13 * before)) break;
      matrix_.factorise(values.gradient(), weights);
      exact = true;
    }
    if (turn > 0 && now <= 1e-12 * before) break;
    before = now;
    remove(weights, values, v);
  }
  return true;
}

// Newton's method. Off the constraints, rows that depend on others on them do not quite: the step
// along these is too long. It is taken back then, and shortened by Levenberg's shift.
bool ConstraintSolver::project_positions(double t, const ParticleView& like, const Axes& q,
                                         const Axes& v, const double* memory, bool near) {
  constexpr int kMost = 60;
  failure_ = Failure::kNone;
  const std::span<const double> weights = constraints_->weights();
  const std::size_t n = weights.size();
  const double size = std::max(constraints_->size(), size_of(q, v, 0, n));
  double before = HUGE_VAL, first = HUGE_VAL, shift = 0;
  bool fresh = false;  // the factors are those of the positions before
  exact_ = false;
  for (int turn = 0;; ++turn) {
    if (!evaluate(t, like, q, v, memory, values_)) return ran_away(first, values_);
    const double now = values_.largest_phi();
    if (turn == 0) first = now;
    if (now <= kRoundings * size) {
      if (turn == 0 && !near) matrix_.factorise(values_.gradient(), weights), exact_ = true;
      break;
    }
    const bool slow = turn > 0 && !(now < 0.1 * before);
    if (slow && fresh && now <= kGoodEnough * size && !(now < 0.5 * before)) break;
    if (turn == kMost || !std::isfinite(now)) return fail(Failure::kTooFar, values_);
    if (turn > 0 && now > kTooLong * before && shift < kMostShift) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        std::copy_n(trial_.data() + axis * n, n, q[axis]);
      if (!evaluate(t, like, q, v, memory, values_)) return ran_away(first, values_);
      shift = std::max(kLeastShift, kGrows * shift);
      matrix_.factorise(values_.gradient(), weights, shift);
      fresh = true;
    } else {
      shift = shift > kLeastShift ? shift / kGrows : 0;
      fresh = (turn == 0 && !near) || slow;
      if (fresh) matrix_.factorise(values_.gradient(), weights, shift);
      before = now;
      for (std::size_t axis = 0; axis < 3; ++axis)
        std::copy_n(q[axis], n, trial_.data() + axis * n);
    }
    std::ranges::copy(values_.phi(), rest_.begin());
    remove(weights, values_, q);
  }
  return true;
}

bool ConstraintSolver::project_state(double t, const ParticleView& like, const Axes& q,
                                     const Axes& v, double* memory, bool near) {
  return project_positions(t, like, q, v, memory, near) &&
         project_velocities(constraints_->weights(), values_, v, exact_);
}

bool ConstraintSolver::shake_positions(double t, double d, const ParticleView& like, const Axes& q,
                                       const Axes& v, const double* memory,
                                       std::span<const double> weights, bool factorised) {
  constexpr int kMost = 60, kFew = 12;
  failure_ = Failure::kNone;
  if (!evaluate(t, like, q, v, memory, values_)) return false;
  if (!factorised) matrix_.factorise_obeyed(values_.gradient(), weights);

  // To second order phi(t + d) = d (J v + drive) + d^2/2 bias.
  values_.times(v.data(), rest_.data());
  for (std::size_t r = 0; r < rest_.size(); ++r)
    rest_[r] += values_.drive()[r] + 0.5 * d * values_.bias()[r];
  remove(weights, values_, v);
  std::ranges::copy(rest_, lambda_.begin());

  const std::size_t n = weights.size();
  const double size = std::max(constraints_->size(), size_of(q, v, d, n));
  const Axes kinematic = {trial_.data(), trial_.data() + n, trial_.data() + 2 * n};
  double before = HUGE_VAL, first = HUGE_VAL;
  bool exact = true;
  for (int turn = 0;; ++turn) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t i = 0; i < n; ++i) kinematic[axis][i] = q[axis][i] + d * v[axis][i];
    if (!evaluate(t + d, like, kinematic, v, memory, other_)) return ran_away(first, other_);
    const double now = other_.largest_phi();
    if (turn == 0) first = now;
    if (now <= kRoundings * size) break;
    const bool slow = turn > 0 && !(now < 0.5 * before);
    if (slow && now <= kGoodEnough * size) break;
    const bool diverges = turn > kFew && now > first;
    if (turn == kMost || diverges || !std::isfinite(now)) {
      fail(Failure::kTooFar, other_);
      residual_ = std::min(residual_, first);  // more informative than that of the divergence
      return false;
    }
    if (slow && exact) {  // over a long way factors from its end may serve better
      matrix_.factorise(other_.gradient(), weights);
      exact = false;
    }
    before = now;
    for (std::size_t r = 0; r < rest_.size(); ++r) rest_[r] = other_.phi()[r] / d;
    remove(weights, values_, v);
    for (std::size_t r = 0; r < rest_.size(); ++r) lambda_[r] += rest_[r];
  }
  return true;
}

// A force lambda = mu / tau turns displacements into accelerations by W sum lambda c.
double ConstraintSolver::stiffness(double d, double tau, const ParticleView& view,
                                   const double* memory) {
  return d * d / std::fabs(tau) * curvature_.of(view, memory, lambda_);
}

bool ConstraintSolver::drift(double t, double d, const ParticleView& like, const Axes& q,
                             const Axes& v, const double* memory, std::span<const double> weights) {
  constexpr int kMostParts = 16;
  const std::size_t n = weights.size();
  if (!implicit_drift_) {
    implicit_drift_ = std::make_unique<ImplicitDrift>(*constraints_);
    start_.resize(6 * n);
  }
  const auto each_axis = [&](const auto& copy) {
    for (std::size_t axis = 0; axis < 6; ++axis)
      copy(axis < 3 ? q[axis] : v[axis - 3], start_.data() + axis * n);
  };
  each_axis([&](const double* from, double* to) { std::copy_n(from, n, to); });
  for (int parts = 1; parts <= kMostParts; parts *= 2) {
    if (rattle_velocities(t, like, q, v, memory, weights) &&
        drift_in_parts(parts, t, d, like, q, v, memory))
      return true;
    each_axis([&](double* to, const double* from) { std::copy_n(from, n, to); });
  }
  return false;
}

bool ConstraintSolver::drift_in_parts(int parts, double t, double d, const ParticleView& like,
                                      const Axes& q, const Axes& v, const double* memory) {
  for (int part = 0; part < parts; ++part) {
    const double begin = t + part * (d / parts), end = t + (part + 1) * (d / parts);
    if (!implicit_drift_->move(begin, end - begin, like, q, v, memory) ||
        !rattle_velocities(end, like, q, v, memory, constraints_->weights()))
      return false;
  }
  return true;
}

bool ConstraintSolver::rattle_velocities(double t, const ParticleView& like, const Axes& q,
                                         const Axes& v, const double* memory,
                                         std::span<const double> weights) {
  failure_ = Failure::kNone;
  if (!evaluate(t, like, q, v, memory, values_)) return false;
  matrix_.factorise_obeyed(values_.gradient(), weights);
  return project_velocities(weights, values_, v, true);
}

}  // namespace sim
