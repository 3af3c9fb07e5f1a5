#include "constrained_stage_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/assert.h"

namespace sim {
namespace {

constexpr int kMostStageTurns = 25;
constexpr double kStageSolved = 1e-14;  // relative to the terms of the equations: rounding
constexpr double kStageStalls = 1e-10;  // accepted if iterations stall
constexpr double kRowShift = 1e-11;     // of a pivot, where rows follow from others
constexpr double kRunsAway = 1e6;       // times the residual of the guess

}  // namespace

std::unique_ptr<ConstrainedStageSolver> ConstrainedStageSolver::make(
    Particles& system, const Constraints& constraints, std::size_t internal_begin,
    std::function<bool()> stopped) {
  std::optional<std::vector<std::array<int, 2>>> pairs = PluginForceJacobian(system).couplings();
  if (!pairs) return nullptr;
  return std::unique_ptr<ConstrainedStageSolver>(new ConstrainedStageSolver(
      system, constraints, internal_begin, *std::move(pairs), std::move(stopped)));
}

ConstrainedStageSolver::ConstrainedStageSolver(Particles& system, const Constraints& constraints,
                                               std::size_t internal_begin,
                                               std::vector<std::array<int, 2>> pairs,
                                               std::function<bool()> stopped)
    : constraints_(&constraints),
      internal_begin_(internal_begin),
      equation_(system),
      stage_(system, std::move(stopped)),
      pairs_(std::move(pairs)),
      rows_(constraints.rows()),
      curvature_(constraints.rows(), system.layout().n()),
      force_(static_cast<std::size_t>(constraints.rows().rows())),
      mu_(force_.size()) {
  stage_.stiffness().for_each([&](int a, int b, SpringStiffness) { pairs_.push_back({a, b}); });
  order_ = saddle_order(constraints, pairs_);
  make_matrix();
  rest_.resize(static_cast<std::size_t>(order_.unknowns));
}

void ConstrainedStageSolver::make_matrix() {
  const RowPattern& pattern = constraints_->rows().pattern;
  std::vector<std::pair<int, int>> upper;
  const auto at = [&](int i) { return order_.particle_at[static_cast<std::size_t>(i)]; };
  const auto add_block = [&](int i, int j) {
    if (at(i) < 0 || at(j) < 0) return;
    const auto [low, high] = std::minmax({at(i), at(j)});
    for (int row = 0; row < 3; ++row)
      for (int column = i == j ? row : 0; column < 3; ++column)
        upper.emplace_back(low + row, high + column);
  };
  for (int i = 0; i < static_cast<int>(order_.particle_at.size()); ++i) add_block(i, i);
  for (const auto& [i, j] : pairs_) add_block(i, j);
  for (int r = 0; r < pattern.rows(); ++r) {
    const int own = order_.row_at[static_cast<std::size_t>(r)];
    const std::span<const int> ids = pattern.of(r);
    if (own < 0) continue;
    ++equations_;
    upper.emplace_back(own, own);
    for (std::size_t a = 0; a < ids.size(); ++a) {
      for (std::size_t b = a + 1; b < ids.size(); ++b) add_block(ids[a], ids[b]);
      for (int axis = 0; axis < 3 && at(ids[a]) >= 0; ++axis)
        upper.emplace_back(at(ids[a]) + axis, own);
    }
  }
  matrix_ = std::make_unique<SparseSymmetric>(order_.unknowns, upper);
}

// Adds the block of particles i and j; the other triangle follows by symmetry.
void ConstrainedStageSolver::add(int i, int j, const Mat3& block, double factor) {
  const int at = order_.particle_at[static_cast<std::size_t>(i)];
  const int by = order_.particle_at[static_cast<std::size_t>(j)];
  if (at < 0 || by < 0) return;
  const std::span<double> values = matrix_->values();
  for (std::size_t column = 0; column < 3; ++column)
    for (std::size_t row = 0; row < (i == j ? column + 1 : 3); ++row) {
      const int low = std::min(at, by) + static_cast<int>(row);
      const int high = std::max(at, by) + static_cast<int>(column);
      values[static_cast<std::size_t>(matrix_->entry(low, high))] +=
          factor * (at <= by ? block(row, column) : block(column, row));
    }
}

// Assembles the matrix at the present point. `definite`: leaves out the negative curvature of
// compressed springs and rods, so that A is positive definite.
void ConstrainedStageSolver::assemble(bool definite) {
  stage_.at(equation_.view(), equation_.tau(),
            {.clamped = definite, .share = definite ? 0.9 : HUGE_VAL});
  const std::span<double> values = matrix_->values();
  std::ranges::fill(values, 0.0);
  for (int i = 0; i < static_cast<int>(order_.particle_at.size()); ++i)
    add(i, i, stage_.diagonal(i), 1);
  const auto add_pair = [&](int i, int j, const Mat3& block) { add(i, j, block, 1); };
  stage_.for_each_pair(add_pair, add_pair);
  add_constraints(definite);
}

void ConstrainedStageSolver::add_constraints(bool definite) {
  const RowPattern& pattern = constraints_->rows().pattern;
  const std::span<double> values = matrix_->values();
  const auto add_to = [&](int low, int high, double value) {
    values[static_cast<std::size_t>(matrix_->entry(low, high))] += value;
  };
  curvature_.evaluate(equation_.view(), memory_);
  std::size_t pair = 0;
  for (std::size_t r = 0; r < mu_.size(); ++r) {
    const std::span<const int> ids = pattern.of(static_cast<int>(r));
    const double factor = -equation_.tau() * mu_[r];
    // The mean curvature over directions, from the trace of the first particle's block; for a rod
    // in proportion to 1 / length.
    const Mat3& first_block = curvature_.blocks()[pair];
    const double trace = first_block(0, 0) + first_block(1, 1) + first_block(2, 2);
    const bool counts = !definite || factor * trace > 0;
    for (std::size_t a = 0; a < ids.size(); ++a)
      for (std::size_t b = a; b < ids.size(); ++b, ++pair)
        if (counts) add(ids[a], ids[b], curvature_.blocks()[pair], factor);

    const int own = order_.row_at[r];
    if (own < 0) continue;
    double pivot = 0;
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const int first = order_.particle_at[static_cast<std::size_t>(ids[k])];
      if (first < 0) continue;
      const Vec3& gradient = rows_.gradient()[static_cast<std::size_t>(pattern.begin[r]) + k];
      pivot += gradient.squaredNorm() / stage_.shift(ids[k]);
      for (int axis = 0; axis < 3; ++axis)
        add_to(first + axis, own, gradient[static_cast<std::size_t>(axis)]);
    }
    add_to(own, own, -kRowShift * pivot);
  }
}

// rest_ := minus the residual of the equations; returns its largest entry, relative to the largest
// impulse and to the size of the constraints.
double ConstrainedStageSolver::residual() {
  equation_.evaluate();
  if (!rows_.evaluate(equation_.view(), memory_)) return HUGE_VAL;
  const RowPattern& pattern = constraints_->rows().pattern;
  const auto g = equation_.layout().axes(std::as_const(equation_.gradient()).data());
  double impulse = 0, left = 0, off = 0;
  const auto each_axis = [&](int i, auto visit) {
    if (const int first = order_.particle_at[static_cast<std::size_t>(i)]; first >= 0)
      for (std::size_t axis = 0; axis < 3; ++axis)
        visit(rest_[static_cast<std::size_t>(first) + axis], axis);
  };
  const int n = static_cast<int>(order_.particle_at.size());
  for (int i = 0; i < n; ++i)
    each_axis(i, [&](double& rest, std::size_t axis) {
      rest = -g[axis][i];
      impulse = std::max(impulse, std::fabs(rest));
    });
  for (std::size_t r = 0; r < mu_.size(); ++r) {
    if (order_.row_at[r] < 0) continue;
    rest_[static_cast<std::size_t>(order_.row_at[r])] = -rows_.phi()[r] / equation_.tau();
    off = std::max(off, std::fabs(rows_.phi()[r]));
    for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
      const Vec3 share = mu_[r] * rows_.gradient()[static_cast<std::size_t>(e)];
      each_axis(pattern.ids[static_cast<std::size_t>(e)], [&](double& rest, std::size_t axis) {
        rest += share[axis];
        impulse = std::max(impulse, std::fabs(share[axis]));
      });
    }
  }
  for (int i = 0; i < n; ++i)
    each_axis(i, [&](double& rest, std::size_t) { left = std::max(left, std::fabs(rest)); });
  return std::max(impulse > 0 ? left / impulse : 0.0, off / constraints_->size());
}

// One Newton step; false if its matrix cannot be factorised.
bool ConstrainedStageSolver::improve() {
  const auto factorise = [&](bool definite) {
    assemble(definite);
    ++effort_.factorisations;
    return matrix_->factorise_indefinite() && matrix_->negative_pivots() == equations_;
  };
  minimum_ = factorise(false);
  if (!minimum_ && !factorise(true)) return false;
  matrix_->solve(rest_);
  const auto d = equation_.layout().axes(equation_.direction().data());
  for (std::size_t i = 0; i < order_.particle_at.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      d[axis][i] = order_.particle_at[i] < 0
                       ? 0.0
                       : rest_[static_cast<std::size_t>(order_.particle_at[i]) + axis];
  for (std::size_t r = 0; r < mu_.size(); ++r)
    if (order_.row_at[r] >= 0) mu_[r] -= rest_[static_cast<std::size_t>(order_.row_at[r])];
  equation_.start_here();
  equation_.place(1);
  ++effort_.newton;
  return true;
}

StepStatus ConstrainedStageSolver::solve(double t, double tau, const double* r, double* y) {
  memory_ = y + internal_begin_;
  for (std::size_t row = 0; row < mu_.size(); ++row) mu_[row] = tau * force_[row];
  equation_.begin(t, tau, r, y);
  minimum_ = false;
  const std::int64_t evaluations = equation_.evaluations();
  const double first = residual();
  bool found = false;
  double before = HUGE_VAL, now = first;
  for (int turn = 0; turn < kMostStageTurns && std::isfinite(now) && now <= kRunsAway * first;
       ++turn) {
    if (stage_.stopped()) return StepStatus::kStopped;
    found = minimum_ && (now <= kStageSolved || (now <= kStageStalls && !(now < 0.5 * before)));
    if (found || !improve()) break;
    before = now;
    now = residual();
  }
  effort_.evaluations += equation_.evaluations() - evaluations;
  if (!found) return StepStatus::kNotConverged;
  effort_.residual = std::max(effort_.residual, now);
  for (std::size_t row = 0; row < mu_.size(); ++row) force_[row] = mu_[row] / tau;
  constraints_->follow(equation_.view(), memory_);
  return StepStatus::kDone;
}

void ConstrainedStageSolver::restart() { std::ranges::fill(force_, 0.0); }

void ConstrainedStageSolver::recall(std::span<const double> memory) {
  SIM_ASSERT(memory.size() == force_.size());
  std::ranges::copy(memory, force_.begin());
}

}  // namespace sim
