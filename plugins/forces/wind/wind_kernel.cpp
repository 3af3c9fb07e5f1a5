#include "core/simd/inverse_sqrt.h"
#include "wind_law.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "wind_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

SIM_INLINE V3<double> plus(const V3<double>& a, const V3<double>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
SIM_INLINE Doubles dot(const V3<double>& a, const V3<double>& b) {
  return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}
SIM_INLINE V3<double> cross(const V3<double>& a, const V3<double>& b) {
  return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}
// s a + b.
SIM_INLINE V3<double> scaled(Doubles s, const V3<double>& a, const V3<double>& b) {
  return {fma(s, a.x, b.x), fma(s, a.y, b.y), fma(s, a.z, b.z)};
}
SIM_INLINE V3<double> splat3(const Vec3& v) {
  return {splat<double>(v[0]), splat<double>(v[1]), splat<double>(v[2])};
}

// A whole number near v, at most 1/2 away, for |v| < 2^51.
SIM_INLINE Doubles rounded(Doubles v) {
  const Doubles large = splat<double>(0x1.8p52);
  return (v + large) - large;
}
// The knot below v, or v - 1 if v is one: b is the same from both sides.
SIM_INLINE Doubles knot_of(Doubles v) { return rounded(v - splat<double>(0.5)); }

// velocity += e b(k.x + s). Points far away or not finite take b at 0.
SIM_INLINE void add_wave(const AirWave& wave, const V3<double>& x, V3<double>& velocity) {
  const Doubles zero{}, period = splat<double>(wave.period);
  Doubles place = dot(splat3(wave.k), x) + splat<double>(wave.s);
  place = place * place < splat<double>(0x1p80) ? place : zero;
  place = fma(-period, rounded(place * splat<double>(wave.inverse)), place);
  place = place < zero ? place + period : place;
  const Doubles below = knot_of(place), knot = below < zero ? zero : below, u = place - knot;
  const double first = knot[0];
  const Doubles others = knot - splat<double>(first);
  Doubles b;
  if (!any_above(others * others, 0)) {  // as a rule: neighbours are near
    const double* const c = wave.table + 8 * static_cast<std::ptrdiff_t>(first);
    b = fma(u, fma(u, splat<double>(c[6]), splat<double>(c[5])), splat<double>(c[4]));
    b = fma(u, fma(u, fma(u, b, splat<double>(c[2])), splat<double>(c[1])), splat<double>(c[0]));
  } else {
    std::int32_t index[kDoubles];
    for (int lane = 0; lane < kDoubles; ++lane)
      index[lane] = 2 * static_cast<std::int32_t>(knot[lane]);
    const V3<double> low = gather(wave.table, index), high = gather(wave.table + 4, index);
    b = fma(u, fma(u, high.z, high.y), high.x);
    b = fma(u, fma(u, fma(u, b, low.z), low.y), low.x);
  }
  velocity = scaled(b, splat3(wave.e), velocity);
}

// Data shared by all triangles of a sweep, in a place that no store can change.
struct Wind {
  Doubles normal, tangential;  // of a third of the force
  bool linear;
  AirNow air;

  SIM_INLINE Wind(const WindLaw& law, const AirNow& now)
      : normal(splat<double>(law.normal / 6)),
        tangential(splat<double>(law.tangential / 6)),
        linear(law.linear),
        air(now) {}

  SIM_INLINE V3<double> velocity(const V3<double> (&x)[3]) const {
    V3<double> sum = splat3(air.mean);
    if (air.waves == 0) return sum;
    const Doubles third = splat<double>(1.0 / 3);
    const V3<double> all = plus(plus(x[0], x[1]), x[2]);
    const V3<double> middle = {third * all.x, third * all.y, third * all.z};
    for (int i = 0; i < air.waves; ++i)
      add_wave(air.wave[static_cast<std::size_t>(i)], middle, sum);
    return sum;
  }
};

// 1 / v, to some 2 ulp, from a seed in single precision; exact division if that fails, and 1 / 0 =
// 0.
SIM_INLINE Doubles inverse(Doubles v) {
  const Doubles one = splat<double>(1), zero{};
  const Doubles r = inverse_seed(v), e = fma(-v, r, one), near = fma(r, fma(e, e, e), r);
  if (!any_above(e * e, kSeedError)) [[likely]]
    return near;
  return e * e <= splat<double>(kSeedError) ? near : v != zero ? one / v : zero;
}

// A third of the force on triangles. With N = (b - a) x (c - a) = 2 A n, q = N.N, s = w.N:
//   quadratic  F = s / q (normal |s| - R) N + R w,  R = tangential sqrt(q w.w - s^2)
//   linear     F = s / q (normal sqrt(q) - R) N + R w,  R = tangential sqrt(q)
// Cancellation of squares in R is harmless: then w_t, to which it applies, is small itself.
SIM_INLINE V3<double> third_of(const Wind& wind, const V3<double> (&x)[3],
                               const V3<double> (&v)[3]) {
  const V3<double> w =
      scaled(splat<double>(-1.0 / 3), plus(plus(v[0], v[1]), v[2]), wind.velocity(x));
  const V3<double> normal = cross(x[1] - x[0], x[2] - x[0]);
  const Doubles q = dot(normal, normal), s = dot(w, normal);
  const Doubles zero{}, square = wind.linear ? q : fma(q, dot(w, w), -(s * s));
  const Doubles root = square_root(square < zero ? zero : square);
  const Doubles along = wind.linear ? root : s < zero ? -s : s;
  const Doubles aside = wind.tangential * root;
  const Doubles across = s * inverse(q) * fma(wind.normal, along, -aside);
  return {fma(across, normal.x, aside * w.x), fma(across, normal.y, aside * w.y),
          fma(across, normal.z, aside * w.z)};
}

// The triangles that the particles [begin, end) own, multiples of 8: a third of the force on them,
// into the ring from `turn` on.
SIM_INLINE void fill(const Wind& wind, const double* const q[3], const double* const v[3],
                     const TriangleRing ring, std::int64_t turn, int begin, int end) {
  for (int i = begin; i < end; i += kDoubles, turn += kDoubles) {
    V3<double> third{};
    if (const unsigned bits = block_bits<double>(ring.bits, i)) {
      const V3<double> x[3] = {load(q, i), load(q, i + ring.b), load(q, i + ring.c)};
      const V3<double> u[3] = {load(v, i), load(v, i + ring.b), load(v, i + ring.c)};
      third = third_of(wind, x, u);
      third = V3<double>{keep(bits, third.x), keep(bits, third.y), keep(bits, third.z)};
    }
    const auto put = [&](std::int64_t at) __attribute__((always_inline)) {
      store(ring.third[0] + at, third.x);
      store(ring.third[1] + at, third.y);
      store(ring.third[2] + at, third.z);
    };
    const std::int64_t to = turn & ring.mask;
    put(to);
    if (to < kWindBlock) put(to + ring.mask + 1);  // once more behind the end
  }
}

// The sums of the rings for the particles from i on, whose block is at `turn`.
SIM_INLINE V3<double> sum_of(std::span<const TriangleRing> rings, std::int64_t turn) {
  V3<double> sum{};
  for (const TriangleRing& ring : rings) {
    const auto from = [&](std::int64_t back) __attribute__((always_inline)) {
      return load(ring.third, (turn - back) & ring.mask);
    };
    sum = plus(sum, plus(plus(from(0), from(ring.b)), from(ring.c)));
  }
  return sum;
}

void sweep_wind(const WindLaw& law, const AirNow& air, const ParticleView& view,
                std::span<const TriangleRing> rings, std::int64_t turn, Tile tile, ForceSink sink) {
  const double* const q[3] = {view.x, view.y, view.z};
  const double* const v[3] = {view.vx, view.vy, view.vz};
  double* const to[3] = {sink.x, sink.y, sink.z};
  const Wind wind(law, air);
  // A ring is not read right after it was written, which would stall.
  for (int begin = tile.begin; begin < tile.end; begin += kWindChunk, turn += kWindChunk) {
    const int end = std::min(begin + kWindChunk, tile.end);
    for (const TriangleRing& ring : rings) fill(wind, q, v, ring, turn, begin, end);
    if (!to[0]) continue;
    for (int i = begin; i < end; i += kDoubles) {
      const V3<double> sum = sum_of(rings, turn + (i - begin));
      const Doubles axes[3] = {sum.x, sum.y, sum.z};
      for (int axis = 0; axis < 3; ++axis)
        if (i + kDoubles <= end) {
          store(to[axis] + i, load(to[axis] + i) + axes[axis]);
        } else {
          for (int lane = 0; i + lane < end; ++lane) to[axis][i + lane] += axes[axis][lane];
        }
    }
  }
}

void wind_any(const WindLaw& law, const AirNow& air, const ParticleView& view, const int* ids,
              int begin, int end, double* third, std::size_t stride) {
  const double* const from[6] = {view.x, view.y, view.z, view.vx, view.vy, view.vz};
  const Wind wind(law, air);
  for (int t = begin; t < end; t += kDoubles) {
    double numbers[18][kDoubles];
    for (int lane = 0; lane < kDoubles; ++lane)
      for (int corner = 0; corner < 3; ++corner) {
        const int id = ids[3 * (t + lane < end ? t + lane : end - 1) + corner];
        for (int i = 0; i < 6; ++i) numbers[6 * corner + i][lane] = from[i][id];
      }
    V3<double> x[3], v[3];
    for (int corner = 0; corner < 3; ++corner) {
      const auto number = [&](int i) { return load(numbers[6 * corner + i]); };
      x[corner] = {number(0), number(1), number(2)};
      v[corner] = {number(3), number(4), number(5)};
    }
    const V3<double> force = third_of(wind, x, v);
    for (int lane = 0; lane < kDoubles && t + lane < end; ++lane) {
      double* const to = third + t + lane;
      to[0] = force.x[lane];
      to[stride] = force.y[lane];
      to[2 * stride] = force.z[lane];
    }
  }
}

constexpr WindKernels kWind{sweep_wind, wind_any};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

WindKernels wind_kernels() { return SIM_CHOOSE(kWind); }

}  // namespace sim
#endif
