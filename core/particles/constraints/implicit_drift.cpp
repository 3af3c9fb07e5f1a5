#include "core/particles/constraints/implicit_drift.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim {
namespace {

constexpr int kMostIterations = 40;
constexpr double kSolved = 1e-15;     // relative to the scene: the rounding error of phi
constexpr double kGainsNone = 1e-13;  // accepted if iterations stall
constexpr double kRegular = 1e-12;    // of a pivot, where rows follow from others

}  // namespace

ImplicitDrift::ImplicitDrift(const Constraints& constraints)
    : constraints_(&constraints),
      middle_(constraints.rows()),
      end_(constraints.rows()),
      order_(saddle_order(constraints, {})),
      lambda_(static_cast<std::size_t>(constraints.rows().rows())),
      u_(3 * constraints.weights().size()),
      trial_(u_.size()) {
  make_matrix();
  rest_.resize(static_cast<std::size_t>(order_.unknowns));
  curvature_.resize(pairs_.size());
}

void ImplicitDrift::make_matrix() {
  const RowPattern& pattern = constraints_->rows().pattern;
  std::vector<std::pair<int, int>> upper;
  for (int k = 0; k < order_.unknowns; ++k) upper.emplace_back(k, k);
  const auto between = [](int a, int b, int axis) {
    return std::pair(std::min(a, b) + axis, std::max(a, b) + axis);
  };
  const auto at = [&](int i) { return order_.particle_at[static_cast<std::size_t>(i)]; };
  for (int r = 0; r < pattern.rows(); ++r) {
    const std::span<const int> ids = pattern.of(r);
    for (std::size_t k = 0; k < ids.size(); ++k) {
      if (at(ids[k]) < 0) continue;
      for (int axis = 0; axis < 3; ++axis) {
        upper.emplace_back(at(ids[k]) + axis, order_.row_at[static_cast<std::size_t>(r)]);
        for (std::size_t l = k + 1; l < ids.size(); ++l)
          if (at(ids[l]) >= 0) upper.push_back(between(at(ids[k]), at(ids[l]), axis));
      }
    }
  }
  matrix_ = std::make_unique<SparseSymmetric>(order_.unknowns, upper);

  const auto entry_of = [&](const std::pair<int, int>& place) {
    return matrix_->entry(place.first, place.second);
  };
  for (const int first : order_.particle_at) {
    std::array<int, 3>& entry = mass_entry_.emplace_back();
    for (int axis = 0; axis < 3; ++axis)
      entry[static_cast<std::size_t>(axis)] =
          first < 0 ? -1 : entry_of({first + axis, first + axis});
  }
  for (int r = 0; r < pattern.rows(); ++r) {
    const int own = order_.row_at[static_cast<std::size_t>(r)];
    row_entry_.push_back(own < 0 ? -1 : entry_of({own, own}));
    const std::span<const int> ids = pattern.of(r);
    for (std::size_t k = 0; k < ids.size(); ++k) {
      std::array<int, 3>& entry = gradient_entry_.emplace_back();
      for (int axis = 0; axis < 3; ++axis)
        entry[static_cast<std::size_t>(axis)] =
            at(ids[k]) < 0 ? -1 : entry_of({at(ids[k]) + axis, own});
      for (std::size_t l = k; l < ids.size(); ++l) {
        Pair& pair = pairs_.emplace_back(Pair{r, ids[k], ids[l], {-1, -1, -1}});
        if (at(pair.a) >= 0 && at(pair.b) >= 0)
          for (int axis = 0; axis < 3; ++axis)
            pair.entry[static_cast<std::size_t>(axis)] =
                entry_of(between(at(pair.a), at(pair.b), axis));
      }
    }
  }
}

// Evaluates the rows at q + share u.
bool ImplicitDrift::evaluate(double t, ParticleView like, const Axes& q, const double* memory,
                             double share, RowValues& values) {
  const std::size_t n = order_.particle_at.size();
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < n; ++i)
      trial_[axis * n + i] = q[axis][i] + share * u_[axis * n + i];
  like.t = t;
  like.x = trial_.data(), like.y = trial_.data() + n, like.z = trial_.data() + 2 * n;
  return values.evaluate(like, memory);
}

// rest_ := minus the residual of the equations; returns its largest entry, m.
double ImplicitDrift::residual(double d, const Axes& v) {
  const std::size_t n = order_.particle_at.size();
  const RowPattern& pattern = constraints_->rows().pattern;
  const std::span<const double> weights = constraints_->weights();
  for (std::size_t i = 0; i < n; ++i)
    if (const int k = order_.particle_at[i]; k >= 0)
      for (std::size_t axis = 0; axis < 3; ++axis)
        rest_[static_cast<std::size_t>(k) + axis] =
            (d * v[axis][i] - u_[axis * n + i]) / weights[i];
  double most = 0;
  for (std::size_t r = 0; r < lambda_.size(); ++r) {
    if (order_.row_at[r] < 0) continue;
    rest_[static_cast<std::size_t>(order_.row_at[r])] = -end_.phi()[r];
    most = std::max(most, std::fabs(end_.phi()[r]));
    for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const int k = order_.particle_at[static_cast<std::size_t>(pattern.ids[at])];
      if (k < 0) continue;
      for (std::size_t axis = 0; axis < 3; ++axis)
        rest_[static_cast<std::size_t>(k) + axis] += lambda_[r] * middle_.gradient()[at][axis];
    }
  }
  for (std::size_t i = 0; i < n; ++i)
    if (const int k = order_.particle_at[i]; k >= 0)
      for (std::size_t axis = 0; axis < 3; ++axis)
        most = std::max(most, weights[i] * std::fabs(rest_[static_cast<std::size_t>(k) + axis]));
  return most;
}

bool ImplicitDrift::improve() {
  const std::size_t n = order_.particle_at.size();
  const RowPattern& pattern = constraints_->rows().pattern;
  const std::span<const double> weights = constraints_->weights();
  const std::span<double> values = matrix_->values();
  std::ranges::fill(values, 0.0);
  const auto add = [&](int entry, double value) {
    if (entry >= 0) values[static_cast<std::size_t>(entry)] += value;
  };
  for (std::size_t i = 0; i < n; ++i)
    for (const int entry : mass_entry_[i])
      if (entry >= 0) add(entry, 1 / weights[i]);
  for (std::size_t p = 0; p < pairs_.size(); ++p)
    for (const int entry : pairs_[p].entry)
      add(entry, -0.5 * lambda_[static_cast<std::size_t>(pairs_[p].row)] * curvature_[p]);
  for (std::size_t r = 0; r < lambda_.size(); ++r) {
    double pivot = 0;
    for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const Vec3& gradient = middle_.gradient()[at];
      pivot += weights[static_cast<std::size_t>(pattern.ids[at])] * gradient.squaredNorm();
      for (std::size_t axis = 0; axis < 3; ++axis) add(gradient_entry_[at][axis], gradient[axis]);
    }
    add(row_entry_[r], -kRegular * pivot);
  }
  if (!matrix_->factorise_indefinite()) return false;
  matrix_->solve(rest_);
  for (std::size_t i = 0; i < n; ++i)
    if (const int k = order_.particle_at[i]; k >= 0)
      for (std::size_t axis = 0; axis < 3; ++axis)
        u_[axis * n + i] += rest_[static_cast<std::size_t>(k) + axis];
  for (std::size_t r = 0; r < lambda_.size(); ++r)
    if (order_.row_at[r] >= 0) lambda_[r] -= rest_[static_cast<std::size_t>(order_.row_at[r])];
  return true;
}

// A rod that rotates by a in the step has a midpoint gradient of size cos(a / 2). Beyond a = 3 pi /
// 4 the iteration may have found a solution that the motion does not lead to.
bool ImplicitDrift::turns_too_far() const {
  constexpr double kLeast = 0.15;  // cos^2(3 pi / 8)
  const RowPattern& pattern = constraints_->rows().pattern;
  for (std::size_t r = 0; r < lambda_.size(); ++r) {
    double middle = 0, end = 0;
    for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
      middle += middle_.gradient()[static_cast<std::size_t>(e)].squaredNorm();
      end += end_.gradient()[static_cast<std::size_t>(e)].squaredNorm();
    }
    if (order_.row_at[r] >= 0 && !(middle >= kLeast * end)) return true;
  }
  return false;
}

bool ImplicitDrift::move(double t, double d, const ParticleView& like, const Axes& q, const Axes& v,
                         const double* memory) {
  const std::size_t n = order_.particle_at.size();
  double size = constraints_->size();
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < n; ++i) {
      u_[axis * n + i] = d * v[axis][i];
      size = std::max(size, std::fabs(q[axis][i]) + std::fabs(d * v[axis][i]));
    }
  std::ranges::fill(lambda_, 0.0);
  constraints_->rows().write_curvature(like, memory, curvature_);
  double before = HUGE_VAL;
  for (int turn = 0;; ++turn) {
    if (!evaluate(t + 0.5 * d, like, q, memory, 0.5, middle_) ||
        !evaluate(t + d, like, q, memory, 1, end_))
      return false;
    const double now = residual(d, v);
    if (now <= kSolved * size || (now <= kGainsNone * size && !(now < 0.5 * before))) break;
    if (turn == kMostIterations || !std::isfinite(now) || !improve()) return false;
    before = now;
  }
  if (turns_too_far()) return false;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < n; ++i) {
      q[axis][i] += u_[axis * n + i];
      if (order_.particle_at[i] >= 0) v[axis][i] = 2 / d * u_[axis * n + i] - v[axis][i];
    }
  return true;
}

CurvatureBound::CurvatureBound(const Constraints& constraints)
    : constraints_(&constraints),
      curvature_(constraints.rows().pairs()),
      sums_(constraints.weights().size()) {}

double CurvatureBound::of(const ParticleView& view, const double* memory,
                          std::span<const double> impulses) {
  const RowPattern& pattern = constraints_->rows().pattern;
  constraints_->rows().write_curvature(view, memory, curvature_);
  std::ranges::fill(sums_, 0.0);
  const double* next = curvature_.data();
  for (int r = 0; r < pattern.rows(); ++r) {
    const std::span<const int> ids = pattern.of(r);
    for (std::size_t a = 0; a < ids.size(); ++a)
      for (std::size_t b = a; b < ids.size(); ++b) {
        const double size = std::fabs(impulses[static_cast<std::size_t>(r)] * *next++);
        sums_[static_cast<std::size_t>(ids[a])] += size;
        if (a != b) sums_[static_cast<std::size_t>(ids[b])] += size;
      }
  }
  double most = 0;
  for (std::size_t i = 0; i < sums_.size(); ++i)
    most = std::max(most, constraints_->weights()[i] * sums_[i]);
  return most;
}

}  // namespace sim
