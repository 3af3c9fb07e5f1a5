#include "multigrid.h"

#include <algorithm>
#include <cmath>

#include "core/simd/lanes.h"

namespace sim {
namespace {

constexpr int kWanted = 36;  // particles of a patch

// Column `column` of P = [I, -[arm]x], which maps the motion of an aggregate to velocities.
Vec3 motion(const Vec3& arm, int column) {
  switch (column) {
    case 3:
      return {0, -arm[2], arm[1]};
    case 4:
      return {arm[2], 0, -arm[0]};
    case 5:
      return {-arm[1], arm[0], 0};
    default:
      return {column == 0 ? 1.0 : 0.0, column == 1 ? 1.0 : 0.0, column == 2 ? 1.0 : 0.0};
  }
}

// Adds P^T y to a column of a block.
void add_motion(const Vec3& arm, const Vec3& y, double* column) {
  const Vec3 turn = arm.cross(y);
  for (std::size_t k = 0; k < 3; ++k) {
    column[k] += y[k];
    column[3 + k] += turn[k];
  }
}

// block -= P_low^T (along I + w w^T) P_high = along P_low^T P_high + (w, low x w) (w, high x w)^T.
void add_between(const Vec3& low, const Vec3& high, double along, const Vec3& w, double* block) {
  constexpr std::size_t kRow = AggregateKernels::kRow;
  const Vec3 turn = low.cross(w), other = high.cross(w);
  const double left[6] = {w[0], w[1], w[2], turn[0], turn[1], turn[2]};
  const double right[6] = {w[0], w[1], w[2], other[0], other[1], other[2]};
#pragma GCC unroll 6
  for (std::size_t column = 0; column < 6; ++column)
#pragma GCC unroll 6
    for (std::size_t row = 0; row < 6; ++row)
      block[column * kRow + row] -= right[column] * left[row];
  // P_low^T P_high = [I, -[high]x; [low]x, low.high I - high low^T]
  const double dot = along * low.dot(high);
#pragma GCC unroll 3
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3, after = (k + 2) % 3;
    block[k * kRow + k] -= along;
    block[k * kRow + 3 + next] -= along * low[after];
    block[k * kRow + 3 + after] += along * low[next];
    block[(3 + next) * kRow + k] -= along * high[after];
    block[(3 + after) * kRow + k] += along * high[next];
    block[(3 + k) * kRow + 3 + k] -= dot;
    for (std::size_t row = 0; row < 3; ++row)
      block[(3 + k) * kRow + 3 + row] += along * high[row] * low[k];
  }
}

// The largest |r|, in eight lanes.
double largest_of(const std::array<const double*, 3>& r, int n) {
  double lanes[8] = {};
  for (const double* const of : r) {
    int i = 0;
    for (; i + 8 <= n; i += 8)
      for (int lane = 0; lane < 8; ++lane) {
        const double size = std::fabs(of[i + lane]);
        lanes[lane] = lanes[lane] > size ? lanes[lane] : size;
      }
    for (; i < n; ++i) lanes[0] = std::max(lanes[0], std::fabs(of[i]));
  }
  return *std::ranges::max_element(lanes);
}

}  // namespace

Multigrid::Multigrid(const StageMatrix& matrix, const Particles& system)
    : matrix_(&matrix), half_(matrix.layout()), springs_(system) {
  std::vector<std::uint8_t> pinned;
  for (const double mass : system.masses()) pinned.push_back(std::isinf(mass));
  const WeightedGraph graph = graph_of(half_.n(), matrix.fixed_pairs());
  aggregates_ = aggregate(graph, pinned, kWanted);
  const WeightedGraph between = graph_between(graph, aggregates_);
  aggregate_matrix_.emplace(between, true);
  const auto n = static_cast<std::size_t>(half_.n());
  first_.assign(static_cast<std::size_t>(aggregates_.count) + 1, 0);
  for (const int aggregate_index : aggregates_.of)
    if (aggregate_index >= 0) ++first_[static_cast<std::size_t>(aggregate_index) + 1];
  for (std::size_t p = 1; p < first_.size(); ++p) first_[p] += first_[p - 1];
  members_.resize(static_cast<std::size_t>(first_.back()));
  std::vector<int> next(first_.begin(), first_.end());
  for (std::size_t i = 0; i < n; ++i)
    if (aggregates_.of[i] >= 0)
      members_[static_cast<std::size_t>(next[static_cast<std::size_t>(aggregates_.of[i])]++)] =
          static_cast<int>(i);
  matrix.stiffness().for_each([&](int a, int b, SpringStiffness) {
    const int low = aggregate_index(a), high = aggregate_index(b);
    if (low >= 0 && high >= 0 && low != high)
      places_.push_back(aggregate_matrix_->place(std::min(low, high), std::max(low, high)));
  });
  arms_.resize(n);
  across_ = Array(6 * n);
  for (Array* array : {&r_, &x_})
    *array = Array(static_cast<std::size_t>(aggregates_.count) * kRow);
  for (ArrayOf<float>* array : {&rest_, &guess_, &more_})
    *array = ArrayOf<float>(springs_.layout().size());
}

// Centres of the aggregates, and arms from there relative to their size, so that all columns of P
// have the same scale.
void Multigrid::assign_aggregates() {
  const Stiffness& springs = matrix_->stiffness();
  for (std::size_t p = 0; p + 1 < first_.size(); ++p) {
    Vec3 centre = Vec3::Zero();
    double size = 0;
    each_member(p, [&](int i) { centre += springs.position(i); });
    centre = centre / (first_[p + 1] - first_[p]);
    each_member(p, [&](int i) {
      Vec3& arm = arms_[static_cast<std::size_t>(i)];
      arm = springs.position(i) - centre;
      size = std::max(size, arm.norm());
    });
    each_member(p, [&](int i) {
      Vec3& arm = arms_[static_cast<std::size_t>(i)];
      arm = size > 0 ? Vec3(arm / size) : Vec3::Zero();
    });
    aggregate_matrix_->centres()[p] = centre;
    aggregate_matrix_->sizes()[p] = size;
  }
}

// P_a^T K P_b for a spring from one aggregate to another. Within an aggregate only its rotation
// changes the spring, by w x (arm_a - arm_b).
void Multigrid::add_springs() {
  std::ranges::fill(across_.span(), 0.0);
  std::size_t spring = 0;
  springs_.for_each([&](int a, int b, double along, const Vec3& w) {
    const int pa = aggregate_index(a), pb = aggregate_index(b);
    if (pa == pb) {
      if (pa < 0) return;
      const Vec3 arm = arms_[static_cast<std::size_t>(a)] - arms_[static_cast<std::size_t>(b)];
      const Vec3 u = arm.cross(w);
      double* const own = aggregate_matrix_->own(pa);
      for (std::size_t col = 0; col < 3; ++col) {
        double* const to = own + (3 + col) * kRow + 3;
        for (std::size_t row = 0; row < 3; ++row)
          to[row] += u[row] * u[col] - along * arm[row] * arm[col];
        to[col] += along * arm.squaredNorm();
      }
      return;
    }
    for (const int end : {a, b}) {
      double* const own = &across_[6 * static_cast<std::size_t>(end)];
      own[0] += along + w[0] * w[0], own[1] += w[0] * w[1], own[2] += w[0] * w[2];
      own[3] += along + w[1] * w[1], own[4] += w[1] * w[2];
      own[5] += along + w[2] * w[2];
    }
    if (pa < 0 || pb < 0) return;
    const Vec3& low = arms_[static_cast<std::size_t>(pa < pb ? a : b)];
    const Vec3& high = arms_[static_cast<std::size_t>(pa < pb ? b : a)];
    add_between(low, high, along, w, aggregate_matrix_->block(places_[spring++]));
  });
}

void Multigrid::add_particles() {
  for (std::size_t p = 0; p + 1 < first_.size(); ++p)
    each_member(p, [&](int i) {
      const double* const d = &across_[6 * static_cast<std::size_t>(i)];
      const double shift = springs_.shift(i);
      const Vec3& arm = arms_[static_cast<std::size_t>(i)];
      for (int column = 0; column < 6; ++column) {
        const Vec3 e = motion(arm, column);
        const Vec3 y(d[0] * e[0] + d[1] * e[1] + d[2] * e[2],
                     d[1] * e[0] + d[3] * e[1] + d[4] * e[2],
                     d[2] * e[0] + d[4] * e[1] + d[5] * e[2]);
        add_motion(arm, y + shift * e, aggregate_matrix_->own(static_cast<int>(p)) + column * kRow);
      }
    });
}

bool Multigrid::prepare() {
  const double largest = matrix_->largest();
  if (aggregates_.count == 0 || !(largest > 0) || !std::isfinite(largest)) return false;
  springs_.take(*matrix_);
  assign_aggregates();
  aggregate_matrix_->clear();
  add_springs();
  add_particles();
  return aggregate_matrix_->prepare();
}

void Multigrid::restrict_rest(const float* rest) {
  const auto from = springs_.layout().axes(rest);
  for (std::size_t p = 0; p + 1 < first_.size(); ++p) {
    Vec3 sum = Vec3::Zero(), turn = Vec3::Zero();
    each_member(p, [&](int i) {
      const Vec3 r(from[0][i], from[1][i], from[2][i]);
      sum += r;
      turn += arms_[static_cast<std::size_t>(i)].cross(r);
    });
    double* const to = &r_[p * kRow];
    for (std::size_t k = 0; k < 3; ++k) to[k] = sum[k], to[3 + k] = turn[k];
  }
}

void Multigrid::add_motions(float* x) {
  const auto to = springs_.layout().axes(x);
  for (std::size_t p = 0; p + 1 < first_.size(); ++p) {
    const double* const from = &x_[p * kRow];
    const Vec3 u(from[0], from[1], from[2]), w(from[3], from[4], from[5]);
    each_member(p, [&](int i) {
      const Vec3 v = u + w.cross(arms_[static_cast<std::size_t>(i)]);
      for (std::size_t k = 0; k < 3; ++k) to[k][i] += static_cast<float>(v[k]);
    });
  }
}

double Multigrid::solve(const double* r, double* z) {
  const auto from = half_.axes(r);
  const auto to = half_.axes(z);
  const auto rest = springs_.layout().axes(rest_.data());
  const double most = largest_of(from, half_.n());
  const double unit = most > 0 ? 1 / most : 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < half_.n(); ++i) rest[axis][i] = static_cast<float>(unit * from[axis][i]);

  springs_.scale_rest(rest_.data(), guess_.data());
  springs_.residual(rest_.data(), guess_.data(), more_.data());
  restrict_rest(more_.data());
  aggregate_matrix_->solve(r_.data(), x_.data());
  add_motions(guess_.data());
  springs_.relax(rest_.data(), guess_.data(), more_.data());

  const auto x = springs_.layout().axes(std::as_const(more_).data());
  const double scale = most * springs_.scale();
  double sums[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < half_.n(); ++i) to[axis][i] = scale * static_cast<double>(x[axis][i]);
    sums[axis] = sum_in_lanes(0, half_.n(), [&](int i) { return from[axis][i] * to[axis][i]; });
  }
  return sums[0] + sums[1] + sums[2];
}

}  // namespace sim
