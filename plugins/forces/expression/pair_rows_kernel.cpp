#include "pair_rows.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "pair_rows_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

void measure(const NeighbourBlock& block, int b, const double* points, int first, int count,
             double cutoff, PairRows& rows) {
  for (int half = 0; half < 8; half += kDoubles) {
    std::int32_t own[kDoubles];
    Doubles counts{};
    for (int lane = 0; lane < kDoubles; ++lane) {
      own[lane] = 8 * b + half + lane;
      counts[lane] = block.count[half + lane];
    }
    const V3<double> here = gather(points, own);
    const std::int32_t* slot = block.slots + 8 * std::ptrdiff_t{first} + half;
    for (int k = 0, at = half; k < count; ++k, at += 8, slot += 8) {
      const V3<double> d = here - gather(points, slot);
      const Doubles r = square_root(d.x * d.x + d.y * d.y + d.z * d.z);
      store(rows.d[0] + at, d.x);
      store(rows.d[1] + at, d.y);
      store(rows.d[2] + at, d.z);
      store(rows.r + at, splat<double>(first + k) < counts ? r : splat<double>(cutoff));
    }
  }
}

// Entries beyond the cutoff add exact zeros: the sums do not depend on when the lists were made.
void add(const PairRows& rows, const double* slopes, int count, double cutoff,
         double (&sums)[3][8]) {
  const Doubles limit = splat<double>(cutoff), zero{};
  for (int half = 0; half < 8; half += kDoubles) {
    Doubles x = load(sums[0] + half), y = load(sums[1] + half), z = load(sums[2] + half);
    for (int at = half; at < 8 * count; at += 8) {
      const Doubles r = load(rows.r + at), slope = load(slopes + at);
      const Doubles factor = r > zero ? slope / r : zero * slope, f = r < limit ? factor : zero;
      x = x - f * load(rows.d[0] + at);
      y = y - f * load(rows.d[1] + at);
      z = z - f * load(rows.d[2] + at);
    }
    store(sums[0] + half, x);
    store(sums[1] + half, y);
    store(sums[2] + half, z);
  }
}

constexpr PairRowKernels kPairRows{measure, add};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

PairRowKernels pair_row_kernels() { return SIM_CHOOSE(kPairRows); }

}  // namespace sim
#endif
