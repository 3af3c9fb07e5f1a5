#include "block_multigrid.h"

#include <algorithm>
#include <cmath>

#include "chebyshev.h"

namespace sim {
namespace {

constexpr int kWanted = 16;  // nodes of an aggregate

std::vector<std::uint8_t> which(const Particles& system, bool pinned) {
  std::vector<std::uint8_t> all;
  for (const double mass : system.masses()) all.push_back(std::isinf(mass) == pinned);
  return all;
}

}  // namespace

BlockMultigrid::BlockMultigrid(const StageMatrix& matrix, const Particles& system, BlockPairs pairs)
    : matrix_(&matrix), rows_(matrix, pairs, which(system, false), system.pool()) {
  const WeightedGraph graph = graph_of(rows_.nodes(), pairs);
  motions_.emplace(graph, which(system, true), kWanted);
  coarse_.emplace(graph_between(graph, motions_->aggregates()), 2,
                  AggregateMatrix::Spectrum::kEstimated);
  for (Array* array : {&r_, &x_})
    *array = Array(static_cast<std::size_t>(motions_->count()) * AggregateKernels::kRow);
  for (Array* array : {&right_, &guess_, &rest_})
    *array = Array((static_cast<std::size_t>(rows_.nodes()) + 1) / 2 * 2 * BlockRows::kRow);
}

bool BlockMultigrid::prepare() {
  if (motions_->count() == 0 || !rows_.take()) return false;
  chebyshev_steps(largest_eigenvalue(), steps_);
  const Stiffness& positions = matrix_->stiffness();
  motions_->place([&](int i) { return positions.position(i); }, *coarse_);
  // P_i^T A_ij P_j of the pairs, in double precision: small differences of large numbers.
  coarse_->clear();
  rows_.for_each_upper([&](int i, int j, const Mat3& block) {
    const int p = motions_->of(i), q = motions_->of(j);
    if (p < 0 || q < 0) return;
    const auto add = [&](int row, int column, const Mat3& a, double* to) {
      for (int k = 0; k < 6; ++k)
        AggregateMotions::add_transposed(motions_->arm(row),
                                         a * AggregateMotions::motion(motions_->arm(column), k),
                                         to + k * AggregateKernels::kRow);
    };
    const Mat3 mirrored = transposed(block);
    if (p == q) {
      add(i, j, block, coarse_->own(p));
      if (i != j) add(j, i, mirrored, coarse_->own(p));
    } else if (p < q) {
      add(i, j, block, coarse_->block(coarse_->place(p, q)));
    } else {
      add(j, i, mirrored, coarse_->block(coarse_->place(q, p)));
    }
  });
  return coarse_->prepare();
}

// An estimate of that of D^-1 A with a margin, since power iteration comes from below. It always
// starts from the same vector, so that runs that go on from a checkpoint keep their bits.
double BlockMultigrid::largest_eigenvalue() {
  constexpr int kTurns = 12;
  constexpr double kMargin = 1.2;
  std::ranges::fill(right_.span(), 0.0);
  std::uint32_t noise = 1;
  for (int i = 0; i < rows_.nodes(); ++i)
    for (int k = 0; k < 3; ++k) {
      noise = 1664525 * noise + 1013904223;
      const double value = static_cast<double>(noise >> 8) / (1 << 23) - 1;
      guess_[static_cast<std::size_t>(BlockRows::kRow * i + k)] = motions_->of(i) >= 0 ? value : 0;
    }
  return kMargin * power_iteration(guess_, kTurns, [&](double factor) {
           rows_.residual(right_.data(), guess_.data(), rest_.data());
           rows_.relax(rest_.data(), -factor, false, guess_.data());
         });
}

void BlockMultigrid::smooth(bool from_zero) {
  for (int step = 0; step < kSteps; ++step) {
    const bool zero = from_zero && step == 0;
    if (!zero) rows_.residual(right_.data(), guess_.data(), rest_.data());
    rows_.relax(zero ? right_.data() : rest_.data(), steps_[step], !zero, guess_.data());
  }
}

double BlockMultigrid::solve(const double* r, double* z) {
  constexpr auto kRow = static_cast<std::size_t>(BlockRows::kRow);
  const Layout& layout = matrix_->layout();
  const auto from = layout.axes(r);
  const auto to = layout.axes(z);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int i = 0; i < layout.n(); ++i)
      right_[kRow * static_cast<std::size_t>(i) + axis] = from[axis][i];

  smooth(true);
  rows_.residual(right_.data(), guess_.data(), rest_.data());
  motions_->restrict(
      [&](int i) {
        const double* const at = &rest_[kRow * static_cast<std::size_t>(i)];
        return Vec3(at[0], at[1], at[2]);
      },
      r_.data());
  coarse_->solve(r_.data(), x_.data());
  motions_->prolong(x_.data(), [&](int i, const Vec3& v) {
    for (std::size_t k = 0; k < 3; ++k) guess_[kRow * static_cast<std::size_t>(i) + k] += v[k];
  });
  smooth(false);

  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int i = 0; i < layout.n(); ++i) {
      to[axis][i] = guess_[kRow * static_cast<std::size_t>(i) + axis];
      sum += from[axis][i] * to[axis][i];
    }
  return sum;
}

}  // namespace sim
