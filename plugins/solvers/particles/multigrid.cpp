#include "multigrid.h"

#include <algorithm>
#include <cmath>

#include "core/simd/lanes.h"

namespace sim {
namespace {

constexpr int kWanted = 36;  // particles of an aggregate

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
  motions_.emplace(graph, pinned, kWanted);
  aggregate_matrix_.emplace(graph_between(graph, motions_->aggregates()), 1,
                            AggregateMatrix::Spectrum::kSprings);
  matrix.stiffness().for_each([&](int a, int b, SpringStiffness) {
    const int low = motions_->of(a), high = motions_->of(b);
    if (low >= 0 && high >= 0 && low != high)
      places_.push_back(aggregate_matrix_->place(std::min(low, high), std::max(low, high)));
  });
  across_ = Array(6 * static_cast<std::size_t>(half_.n()));
  for (Array* array : {&r_, &x_})
    *array = Array(static_cast<std::size_t>(motions_->count()) * kRow);
  for (ArrayOf<float>* array : {&rest_, &guess_, &more_})
    *array = ArrayOf<float>(springs_.layout().size());
}

// P_a^T K P_b for a spring from one aggregate to another. Within an aggregate only its rotation
// changes the spring, by w x (arm_a - arm_b).
void Multigrid::add_springs() {
  std::ranges::fill(across_.span(), 0.0);
  std::size_t spring = 0;
  springs_.for_each([&](int a, int b, double along, const Vec3& w) {
    const int pa = motions_->of(a), pb = motions_->of(b);
    if (pa == pb) {
      if (pa < 0) return;
      const Vec3 arm = motions_->arm(a) - motions_->arm(b);
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
    const Vec3& low = motions_->arm(pa < pb ? a : b);
    const Vec3& high = motions_->arm(pa < pb ? b : a);
    add_between(low, high, along, w, aggregate_matrix_->block(places_[spring++]));
  });
}

void Multigrid::add_particles() {
  for (int i = 0; i < half_.n(); ++i) {
    if (motions_->of(i) < 0) continue;
    const double* const d = &across_[6 * static_cast<std::size_t>(i)];
    const double shift = springs_.shift(i);
    const Vec3& arm = motions_->arm(i);
    double* const own = aggregate_matrix_->own(motions_->of(i));
    for (int column = 0; column < 6; ++column) {
      const Vec3 e = AggregateMotions::motion(arm, column);
      const Vec3 y(d[0] * e[0] + d[1] * e[1] + d[2] * e[2], d[1] * e[0] + d[3] * e[1] + d[4] * e[2],
                   d[2] * e[0] + d[4] * e[1] + d[5] * e[2]);
      AggregateMotions::add_transposed(arm, y + shift * e, own + column * kRow);
    }
  }
}

bool Multigrid::prepare() {
  const double largest = matrix_->largest();
  if (motions_->count() == 0 || !(largest > 0) || !std::isfinite(largest)) return false;
  springs_.take(*matrix_);
  const Stiffness& springs = matrix_->stiffness();
  motions_->place([&](int i) { return springs.position(i); }, *aggregate_matrix_);
  aggregate_matrix_->clear();
  add_springs();
  add_particles();
  return aggregate_matrix_->prepare();
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
  const auto more = springs_.layout().axes(std::as_const(more_).data());
  motions_->restrict([&](int i) { return Vec3(more[0][i], more[1][i], more[2][i]); }, r_.data());
  aggregate_matrix_->solve(r_.data(), x_.data());
  const auto guess = springs_.layout().axes(guess_.data());
  motions_->prolong(x_.data(), [&](int i, const Vec3& v) {
    for (std::size_t k = 0; k < 3; ++k) guess[k][i] += static_cast<float>(v[k]);
  });
  springs_.relax(rest_.data(), guess_.data(), more_.data());

  const double scale = most * springs_.scale();
  double sums[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < half_.n(); ++i) to[axis][i] = scale * static_cast<double>(more[axis][i]);
    sums[axis] = sum_in_lanes(0, half_.n(), [&](int i) { return from[axis][i] * to[axis][i]; });
  }
  return sums[0] + sums[1] + sums[2];
}

}  // namespace sim
