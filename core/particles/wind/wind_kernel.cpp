#include "core/particles/wind/wind_forces.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/wind/wind_kernel.cpp"
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

// velocity += e b(k.x + s). What is far away or not a number takes b at 0.
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

// A third of the force on triangles: see wind_on_triangle().
SIM_INLINE V3<double> third_of(const WindLaw& law, const AirNow& air, const V3<double> (&x)[3],
                               const V3<double> (&v)[3]) {
  const Doubles zero{}, third = splat<double>(1.0 / 3), half = splat<double>(1.0 / 6);
  V3<double> velocity = splat3(air.mean);
  if (air.waves > 0) {
    const V3<double> sum = plus(plus(x[0], x[1]), x[2]);
    const V3<double> middle = {third * sum.x, third * sum.y, third * sum.z};
    for (int i = 0; i < air.waves; ++i)
      add_wave(air.wave[static_cast<std::size_t>(i)], middle, velocity);
  }
  const V3<double> w = scaled(-third, plus(plus(v[0], v[1]), v[2]), velocity);
  const V3<double> normal = cross(x[1] - x[0], x[2] - x[0]);
  const Doubles q = dot(normal, normal), s = dot(w, normal);
  const auto has_area = q != zero;
  const Doubles ratio = has_area ? s / q : zero;
  const V3<double> across = scaled(-ratio, normal, w);
  Doubles along, aside;
  if (law.linear) {
    const Doubles root = square_root(q);
    along = half * splat<double>(law.normal) * root * ratio;
    aside = half * splat<double>(law.tangential) * root;
  } else {
    along = half * splat<double>(law.normal) * ratio * (s < zero ? -s : s);
    aside = half * splat<double>(law.tangential) * square_root(q * dot(across, across));
  }
  const V3<double> sideways = {aside * across.x, aside * across.y, aside * across.z};
  return scaled(along, normal, sideways);
}

void wind_run(const WindLaw& law, const AirNow& air, const ParticleView& view,
              const TriangleRun& run, int begin, int end, double* third, std::size_t stride) {
  const double* const q[3] = {view.x, view.y, view.z};
  const double* const v[3] = {view.vx, view.vy, view.vz};
  for (int i = begin; i < end; i += kDoubles) {
    const unsigned bits = block_bits<double>(run.bits.data(), i);
    if (bits == 0) continue;
    const V3<double> x[3] = {load(q, i), load(q, i + run.b), load(q, i + run.c)};
    const V3<double> u[3] = {load(v, i), load(v, i + run.b), load(v, i + run.c)};
    const V3<double> force = third_of(law, air, x, u);
    store(third + i, keep(bits, force.x));
    store(third + stride + i, keep(bits, force.y));
    store(third + 2 * stride + i, keep(bits, force.z));
  }
}

void wind_any(const WindLaw& law, const AirNow& air, const ParticleView& view, const int* ids,
              int begin, int end, double* third, std::size_t stride) {
  const double* const from[6] = {view.x, view.y, view.z, view.vx, view.vy, view.vz};
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
    const V3<double> force = third_of(law, air, x, v);
    for (int lane = 0; lane < kDoubles && t + lane < end; ++lane) {
      double* const to = third + t + lane;
      to[0] = force.x[lane];
      to[stride] = force.y[lane];
      to[2 * stride] = force.z[lane];
    }
  }
}

void add_wind_run(const TriangleRun& run, const double* third, std::size_t stride, Tile tile,
                  ForceSink sink) {
  double* const to[3] = {sink.x, sink.y, sink.z};
  for (int i = tile.begin; i < tile.end; i += kDoubles)
    for (int axis = 0; axis < 3; ++axis) {
      const double* const from = third + static_cast<std::size_t>(axis) * stride + i;
      Doubles sum = load(from);
      if (i + kDoubles > run.b) sum += load(from - run.b);
      if (i + kDoubles > run.c) sum += load(from - run.c);
      if (i + kDoubles <= tile.end) {
        store(to[axis] + i, load(to[axis] + i) + sum);
      } else {
        for (int lane = 0; i + lane < tile.end; ++lane) to[axis][i + lane] += sum[lane];
      }
    }
}

constexpr WindKernels kWind{wind_run, wind_any, add_wind_run};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

WindKernels wind_kernels() { return SIM_CHOOSE(kWind); }

}  // namespace sim
#endif
