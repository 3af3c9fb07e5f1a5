#include "float_springs.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "float_springs_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/simd/narrow.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

SIM_INLINE Doubles root(Doubles v) {
  for (int lane = 0; lane < kDoubles; ++lane) v[lane] = v[lane] > 0 ? std::sqrt(v[lane]) : 0;
  return v;
}

// w = sqrt(across) d, or 0 if the prediction has made `across` negative.
void narrow(const StiffRun& from, const double* const q[3], const double* parts, double scale,
            const FloatSpringRun& to, int begin, int end) {
  const Doubles zero{}, unit = splat<double>(scale);
  for (int i = begin; i < end; i += kDoubles) {
    const unsigned bits = block_bits<double>(from.owners, i);
    if (!bits) continue;
    const V3<double> d = load(q, i) - load(q, i + from.stride);
    const Doubles here = load(parts + i), there = load(parts + i + from.stride);
    const Doubles along = unit * load(from.along + i), least = here < there ? here : there;
    const Doubles size = keep(bits, root(unit * load(from.across + i)));
    store_narrow(to.along + i, keep(bits, along < zero ? along * least : along));
    store_narrow(to.w[0] + i, size * d.x);
    store_narrow(to.w[1] + i, size * d.y);
    store_narrow(to.w[2] + i, size * d.z);
  }
}

struct Symmetric {
  Doubles xx, xy, xz, yy, yz, zz;
};

SIM_INLINE void add_own(const FloatSpringRun& run, std::int64_t at, Symmetric& sum) {
  const Doubles along = load_narrow(run.along + at);
  const Doubles x = load_narrow(run.w[0] + at), y = load_narrow(run.w[1] + at);
  const Doubles z = load_narrow(run.w[2] + at);
  sum.xx += fma(x, x, along);
  sum.xy = fma(x, y, sum.xy);
  sum.xz = fma(x, z, sum.xz);
  sum.yy += fma(y, y, along);
  sum.yz = fma(y, z, sum.yz);
  sum.zz += fma(z, z, along);
}

void diagonal(std::span<const FloatSpringRun> runs, const float* shift, double* const blocks[6],
              int begin, int end) {
  for (int i = begin; i < end; i += kDoubles) {
    Symmetric sum{};
    for (const FloatSpringRun& run : runs) {
      if (block_bits<double>(run.owners, i)) add_own(run, i, sum);
      if (i + kDoubles > run.stride) add_own(run, i - run.stride, sum);
    }
    const Doubles m = load_narrow(shift + i);
    store(blocks[0] + i, m + sum.xx);
    store(blocks[1] + i, sum.xy);
    store(blocks[2] + i, sum.xz);
    store(blocks[3] + i, m + sum.yy);
    store(blocks[4] + i, sum.yz);
    store(blocks[5] + i, m + sum.zz);
  }
}

// sum += along e + w w.e for the springs at `at`.
SIM_INLINE void add_spring(const FloatSpringRun& run, std::int64_t at, const V3<float>& e,
                           V3<float>& sum) {
  const Floats along = load(run.along + at);
  const V3<float> w{load(run.w[0] + at), load(run.w[1] + at), load(run.w[2] + at)};
  const Floats s = fma(w.z, e.z, fma(w.y, e.y, w.x * e.x));
  sum.x = fma(s, w.x, fma(along, e.x, sum.x));
  sum.y = fma(s, w.y, fma(along, e.y, sum.y));
  sum.z = fma(s, w.z, fma(along, e.z, sum.z));
}

template <bool kRelax>
void rest_of(const FloatSpringProduct& f, int begin, int end) {
  constexpr int kFloats = kLanes<float>;
  for (int i = begin; i < end; i += kFloats) {
    const V3<float> x = load(f.x, i);
    V3<float> sum{};
    if (f.before) sum = {load(f.out[0] + i), load(f.out[1] + i), load(f.out[2] + i)};
    for (const FloatSpringRun& run : f.runs) {
      if (block_bits<float>(run.owners, i)) add_spring(run, i, x - load(f.x, i + run.stride), sum);
      if (i + kFloats > run.stride) {
        const std::int64_t a = i - run.stride;
        add_spring(run, a, x - load(f.x, a), sum);
      }
    }
    const Floats shift = load(f.shift + i);
    const V3<float> r = load(f.r, i);
    const Floats rx = r.x - fma(shift, x.x, sum.x), ry = r.y - fma(shift, x.y, sum.y);
    const Floats rz = r.z - fma(shift, x.z, sum.z);
    const unsigned free = block_bits<float>(f.free, i);
    if (!kRelax) {
      store(f.out[0] + i, keep(free, rx));
      store(f.out[1] + i, keep(free, ry));
      store(f.out[2] + i, keep(free, rz));
      continue;
    }
    const Floats xx = load(f.inverses[0] + i), xy = load(f.inverses[1] + i);
    const Floats xz = load(f.inverses[2] + i), yy = load(f.inverses[3] + i);
    const Floats yz = load(f.inverses[4] + i), zz = load(f.inverses[5] + i);
    store(f.out[0] + i, keep(free, fma(xz, rz, fma(xy, ry, fma(xx, rx, x.x)))));
    store(f.out[1] + i, keep(free, fma(yz, rz, fma(yy, ry, fma(xy, rx, x.y)))));
    store(f.out[2] + i, keep(free, fma(zz, rz, fma(yz, ry, fma(xz, rx, x.z)))));
  }
}

constexpr FloatSpringKernels kSingle{narrow, diagonal, rest_of<false>, rest_of<true>};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

FloatSpringKernels float_spring_kernels() { return SIM_CHOOSE(kSingle); }

}  // namespace sim
#endif
