#include "core/particles/explicit/sweep.h"

#include <algorithm>
#include <bit>

#include "core/simd/inverse_sqrt.h"
#include "core/simd/simd_targets.h"

namespace sim {
namespace {

constexpr double kLeastDistance = 1e-15;  // m, in single precision

Vec3 difference(const double* const q[3], std::int64_t a, std::int64_t b) {
  return {q[0][a] - q[0][b], q[1][a] - q[1][b], q[2][a] - q[2][b]};
}

void add(double s, const Vec3& d, int lane, double (*sum)[8]) {
  for (int axis = 0; axis < 3; ++axis) sum[axis][lane] = std::fma(s, d[axis], sum[axis][lane]);
}

// The forces of all runs on a block in which some distance is too large or too small for the fast
// path. Same order of sums and, for the ordinary springs, the same bits.
void careful_block(std::span<const SweepRun<double>> runs, std::int64_t turn,
                   const double* const q[3], int i, int lanes, double (*sum)[8]) {
  for (const SweepRun<double>& run : runs) {
    const std::int64_t to = turn & run.mask;
    for (int lane = 0; lane < lanes; ++lane) {
      const int a = i + lane;
      if (!(run.owners[a >> 3] >> (a & 7) & 1)) continue;
      const double k = run.ks ? run.ks[a] : run.k;
      const double k_rest = run.ks ? k * run.rests[a] : run.k_rest;
      const Vec3 d = difference(q, a, a + run.stride);
      const double s = spring_factor(d, k, k_rest);
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

}  // namespace
}  // namespace sim

#define SIM_KERNEL "core/particles/explicit/sweep.inc"
#include "core/simd/simd_targets.inc"

#define SIM_SINGLE 1
#define SIM_KERNEL "core/particles/explicit/sweep.inc"
#include "core/simd/simd_targets.inc"

namespace sim {

template <>
SweepKernels<double> sweep_kernels() {
  return for_simd_level<SweepKernels<double>>(
      {sse2::rk_sweep, sse2::kick_sweep, sse2::warm_up},
      {avx2::rk_sweep, avx2::kick_sweep, avx2::warm_up},
      {avx512::rk_sweep, avx512::kick_sweep, avx512::warm_up});
}

template <>
SweepKernels<float> sweep_kernels() {
  return for_simd_level<SweepKernels<float>>(
      {sse2::single::rk_sweep, sse2::single::kick_sweep, sse2::single::warm_up},
      {avx2::single::rk_sweep, avx2::single::kick_sweep, avx2::single::warm_up},
      {avx512::single::rk_sweep, avx512::single::kick_sweep, avx512::single::warm_up});
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
    const auto streamed = [&](const Array& values) {
      return run->uniform ? nullptr : values.data() + SpringRun::kPad;
    };
    runs_.push_back({run->owners.data(), streamed(run->ks), streamed(run->rests), run->k,
                     run->k * run->rest, run->stride, entries(*run) - 1, next});
    next += entries(*run) + kBlock<Real>;
  }
}

template <class Real>
void Rings<Real>::clear() {
  std::ranges::fill(memory_.span(), Real{0});
}

template class Rings<double>;
template class Rings<float>;

}  // namespace sim
