#include "core/particles/sweep.h"

#include <algorithm>
#include <array>

#include "core/base/inverse_sqrt.h"
#include "core/base/simd_targets.h"

namespace sim {
namespace {

constexpr std::array<std::int64_t, 16> kLaneNumberTable = {0, 1, 2,  3,  4,  5,  6,  7,
                                                           8, 9, 10, 11, 12, 13, 14, 15};
constexpr const std::int64_t* kLaneNumbers = kLaneNumberTable.data();

// The forces of all runs on a block in which some distance is too large or too small for the fast
// path; the cursors are past the block already. Same order of sums and, for the ordinary springs,
// the same bits.
void careful_block(std::span<SweepRun> runs, const double* const q[3], int i, int lanes,
                   double (*sum)[8]) {
  for (SweepRun& run : runs) {
    const std::int64_t part = run.size + 8;
    const std::int64_t cursor = (run.cursor ? run.cursor : run.size) - lanes;
    for (int lane = 0; lane < lanes; ++lane) {
      const int a = i + lane;
      if (!(run.owners[a >> 3] >> (a & 7) & 1)) continue;
      const std::int64_t b = a + run.stride;
      const double k = run.ks ? run.ks[a] : run.k;
      const double k_rest = run.ks ? k * run.rests[a] : run.k_rest;
      const Vec3 f =
          spring_force({q[0][a] - q[0][b], q[1][a] - q[1][b], q[2][a] - q[2][b]}, k, k_rest);
      for (int axis = 0; axis < 3; ++axis) {
        double* const ring = run.ring + axis * part;
        ring[cursor + lane] = f[axis];
        if (cursor < 8) ring[run.size + cursor + lane] = f[axis];
        sum[axis][lane] += f[axis];
      }
    }
    for (int lane = 0; lane < lanes; ++lane) {
      const std::int64_t from = cursor + lane - run.stride;
      for (int axis = 0; axis < 3; ++axis)
        sum[axis][lane] -= run.ring[axis * part + (from < 0 ? from + run.size : from)];
    }
  }
}

// Likewise for a net: the forces on one block, summed as the fast path does.
void careful_net(const Net& net, const double* const q[3], int i, int lanes, double (*sum)[8]) {
  for (int lane = 0; lane < lanes; ++lane) {
    const int a = i + lane;
    Vec3 total = Vec3::Zero();
    net.at(a, [&](int b, double k, double rest) {
      total += spring_force({q[0][a] - q[0][b], q[1][a] - q[1][b], q[2][a] - q[2][b]}, k, k * rest);
    });
    for (int axis = 0; axis < 3; ++axis) sum[axis][lane] = total[axis];
  }
}

}  // namespace
}  // namespace sim

#define SIM_KERNEL "core/particles/sweep.inc"
#include "core/base/simd_targets.inc"

namespace sim {

SweepKernels sweep_kernels() {
  switch (simd_level()) {
    case SimdLevel::kAvx512:
      return {avx512::net_forces, avx512::rk_sweep, avx512::kick_sweep, avx512::warm_up};
    case SimdLevel::kAvx2:
      return {avx2::net_forces, avx2::rk_sweep, avx2::kick_sweep, avx2::warm_up};
    default:
      return {sse2::net_forces, sse2::rk_sweep, sse2::kick_sweep, sse2::warm_up};
  }
}

Rings::Rings(std::span<const SpringRun* const> runs) {
  std::size_t total = 0;
  for (const SpringRun* run : runs) {
    const std::int64_t size = (run->stride + 7) / 8 * 8 + 8;
    const auto streamed = [&](const Array& values) {
      return run->uniform ? nullptr : values.data() + SpringRun::kPad;
    };
    runs_.push_back({run->owners.data(), streamed(run->ks), streamed(run->rests), run->k,
                     run->k * run->rest, run->stride, size, 0, run->stride % 8 != 0, nullptr});
    total += 3 * static_cast<std::size_t>(size + 8);
  }
  memory_ = Array(total);
  double* next = memory_.data();
  for (SweepRun& run : runs_) {
    run.ring = next;
    next += 3 * (run.size + 8);
  }
}

void Rings::clear() { std::ranges::fill(memory_.span(), 0.0); }

}  // namespace sim
