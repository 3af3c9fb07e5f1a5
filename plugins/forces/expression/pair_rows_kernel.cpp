#include "pair_rows.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "pair_rows_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// The measure of a distance: r, or r^2 where kSquare.
template <bool kSquare>
SIM_INLINE Doubles limit_of(double cutoff) {
  return splat<double>(kSquare ? cutoff * cutoff : cutoff);
}

template <bool kSquare>
void measure(const NeighbourBlock& block, int b, const double* points, int first, int count,
             double cutoff, PairRows& rows) {
  const Doubles limit = limit_of<kSquare>(cutoff), one = splat<double>(1);
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
      const Doubles square = squared(d), known = kSquare ? square : square_root(square);
      const Doubles r = splat<double>(first + k) < counts ? known : limit;
      store(rows.d[0] + at, d.x);
      store(rows.d[1] + at, d.y);
      store(rows.d[2] + at, d.z);
      store(rows.measure + at, r);
      store(rows.inverse + at, one / r);
    }
  }
}

// Entries beyond the cutoff add exact zeros: the sums do not depend on when the lists were made.
template <bool kSquare>
void add(const PairRows& rows, const double* slopes, int count, double cutoff,
         double (&sums)[3][8]) {
  const Doubles limit = limit_of<kSquare>(cutoff), zero{}, one = splat<double>(1);
  for (int half = 0; half < 8; half += kDoubles) {
    Doubles x = load(sums[0] + half), y = load(sums[1] + half), z = load(sums[2] + half);
    for (int at = half; at < 8 * count; at += 8) {
      const Doubles r = load(rows.measure + at), slope = load(slopes + at);
      const Doubles factor = slope * (r > zero ? (kSquare ? one : load(rows.inverse + at)) : zero);
      const Doubles f = r < limit ? -factor : zero;
      x = fma(f, load(rows.d[0] + at), x);
      y = fma(f, load(rows.d[1] + at), y);
      z = fma(f, load(rows.d[2] + at), z);
    }
    store(sums[0] + half, x);
    store(sums[1] + half, y);
    store(sums[2] + half, z);
  }
}

template <bool kSquare>
void add_energies(const PairRows& rows, const double* energies, int count, double cutoff,
                  double (&sums)[8]) {
  const Doubles limit = limit_of<kSquare>(cutoff), half = splat<double>(0.5);
  for (int lane = 0; lane < 8; lane += kDoubles) {
    Doubles sum = load(sums + lane);
    for (int at = lane; at < 8 * count; at += 8)
      sum += load(rows.measure + at) < limit ? half * load(energies + at) : Doubles{};
    store(sums + lane, sum);
  }
}

template <bool kSquare>
constexpr PairRowKernels kPairRows{measure<kSquare>, add<kSquare>, add_energies<kSquare>};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

PairRowKernels pair_row_kernels(bool of_square) {
  return of_square ? SIM_CHOOSE(kPairRows<true>) : SIM_CHOOSE(kPairRows<false>);
}

}  // namespace sim
#endif
