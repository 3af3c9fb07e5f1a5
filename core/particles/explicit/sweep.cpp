#include "core/particles/explicit/sweep.h"

#include <algorithm>
#include <bit>

#include "core/base/assert.h"

namespace sim {
namespace {

Vec3 difference(const double* const q[3], std::int64_t a, std::int64_t b) {
  return {q[0][a] - q[0][b], q[1][a] - q[1][b], q[2][a] - q[2][b]};
}

void add(double s, const Vec3& d, int lane, double (*sum)[8]) {
  for (int axis = 0; axis < 3; ++axis) sum[axis][lane] = std::fma(s, d[axis], sum[axis][lane]);
}

}  // namespace

void add_block_carefully(std::span<const SweepRun<double>> runs, std::int64_t turn,
                         const double* const q[3], int i, int lanes, double (*sum)[8]) {
  SIM_ASSERT(i >= 0 && 0 < lanes && lanes <= 8);
  for (const SweepRun<double>& run : runs) {
    const std::int64_t to = turn & run.mask;
    for (int lane = 0; lane < lanes; ++lane) {
      const int a = i + lane;
      if (!bit(run.owners, a)) continue;
      const Vec3 d = difference(q, a, a + run.stride);
      const double s = spring_factor(run.sense, d, run.k_of(a), run.rest_of(a));
      run.ring[to + lane] = s;
      if (to == 0) run.ring[run.mask + 1 + lane] = s;
      add(s, d, lane, sum);
    }
    for (int lane = 0; lane < lanes; ++lane) {
      const std::int64_t b = i + lane;
      const double s = run.ring[(turn + lane - run.stride) & run.mask];
      if (s != 0) add(s, difference(q, b, b - run.stride), lane, sum);
    }
  }
}

template <class Real>
Rings<Real>::Rings(std::span<const SpringRun* const> runs) {
  const auto entries = [](const SpringRun& run) {
    return static_cast<std::int64_t>(
        std::bit_ceil(static_cast<std::uint64_t>(run.stride + kBlock<Real>)));
  };
  std::size_t total = 0;
  for (const SpringRun* run : runs) total += static_cast<std::size_t>(entries(*run) + kBlock<Real>);
  memory_ = ArrayOf<Real>(total);
  Real* next = memory_.data();
  for (const SpringRun* run : runs) {
    SIM_ASSERT(run->stride > 0);
    const unsigned whole = run->uniform ? kAllOwn<Real> : ~0U;
    runs_.push_back({RunColumns(*run), entries(*run) - 1, next, -std::int64_t{run->stride}, whole});
    next += entries(*run) + kBlock<Real>;
  }
  SIM_ASSERT(next == memory_.data() + total);
}

template <class Real>
void Rings<Real>::clear() {
  std::ranges::fill(memory_.span(), Real{0});
}

template class Rings<double>;
template class Rings<float>;

}  // namespace sim
