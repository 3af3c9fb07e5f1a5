#include "core/particles/springs/stiffness.h"
#include "core/simd/inverse_sqrt.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/springs/stiffness_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/particles/springs/spring_kernel.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// The stiffness of the springs of a run that particles [begin, end) own.
void linearise_run(const StiffRun& run, const double* const q[3], const SpringModel& model,
                   int begin, int end) {
  const Doubles zero{};
  for (int i = begin; i < end; i += kDoubles) {
    const unsigned bits = block_bits<double>(run.owners, i);
    if (!bits) continue;
    const V3<double> d = difference(run, q, i);
    const Doubles square = squared(d);
    const Constants<double> spring(run, i, square);
    const Doubles r = seed(square), e = seed_error(square, r);
    Doubles errors = add_square(bits, e, Doubles{});
    const Doubles inverse = refined(r, e);
    Doubles along, across;
    if (model.before) {
      const V3<double> d0 = difference(run, model.before, i);
      const Doubles square0 = squared(d0), r0 = seed(square0), e0 = seed_error(square0, r0);
      errors = add_square(bits, e0, errors);
      const Doubles dot = fma(d.z, d0.z, fma(d.y, d0.y, d.x * d0.x));
      const Doubles reach = dot * refined(r0, e0);
      // A spring that turns by more than 60 degrees, or has no rest length, is linearised as it is
      // now.
      const Doubles predicted = fma(spring.k, reach, -spring.k_rest) * inverse;
      const Doubles cosine = spring.k_rest > zero ? reach * inverse : zero;
      along = cosine > splat<double>(0.5) ? predicted : spring.k - spring.k_rest * inverse;
      if (model.clamped) along = along > zero ? along : zero;
      across = ((spring.k - along) * inverse) * inverse;
    } else {
      Doubles pull = spring.k_rest * inverse;
      if (model.clamped) pull = pull < spring.k ? pull : spring.k;
      along = spring.k - pull;
      across = (pull * inverse) * inverse;
    }
    if (any_above(errors, kSeedError)) {
      linearise_carefully(run, q, model, i, kDoubles);
      continue;
    }
    store(run.along + i, keep(bits, along));
    store(run.across + i, keep(bits, across));
  }
}

SIM_INLINE Doubles push_of(Doubles along) {
  const Doubles zero{};
  return along < zero ? -along : zero;
}

void add_pushes(std::span<const StiffRun> runs, double* sums, int begin, int end) {
  for (int i = begin; i < end; i += kDoubles) {
    Doubles sum = load(sums + i);
    for (const StiffRun& run : runs) {
      if (block_bits<double>(run.owners, i)) sum += push_of(load(run.along + i));
      if (i + kDoubles > run.stride) sum += push_of(load(run.along + i - run.stride));
    }
    store(sums + i, sum);
  }
}

void soften_run(const StiffRun& run, const double* shares, int begin, int end) {
  const Doubles zero{}, one = splat<double>(1);
  for (int i = begin; i < end; i += kDoubles) {
    const unsigned bits = block_bits<double>(run.owners, i);
    if (!bits) continue;
    const Doubles here = load(shares + i), there = load(shares + i + run.stride);
    const Doubles least = here < there ? here : there;
    const Doubles along = load(run.along + i), share = along < zero ? least : one;
    const Doubles k = (run.ks ? load(run.ks + i) : splat<double>(run.k)), softer = along * share;
    const Doubles factor = share < one ? (k - softer) / (k - along) : one;
    store(run.along + i, keep(bits, softer));
    store(run.across + i, keep(bits, load(run.across + i) * factor));
  }
}

// sum += along e + across (d.e) d for the springs at `at`.
SIM_INLINE void add_stiff(const StiffRun& run, std::int64_t at, const V3<double>& d,
                          const V3<double>& e, V3<double>& sum) {
  const Doubles along = load(run.along + at);
  const Doubles s = load(run.across + at) * fma(d.z, e.z, fma(d.y, e.y, d.x * e.x));
  sum.x = fma(s, d.x, fma(along, e.x, sum.x));
  sum.y = fma(s, d.y, fma(along, e.y, sum.y));
  sum.z = fma(s, d.z, fma(along, e.z, sum.z));
}

// Each spring is evaluated from both its ends, so that no force passes through memory, only its two
// numbers.
void stiff_product(std::span<const StiffRun> runs, const StiffProduct& f, int begin, int end,
                   double (&sums)[8]) {
  constexpr int kParts = 8 / kDoubles;
  Doubles dots[kParts] = {};
  for (int block = begin; block < end; block += 8)
    for (int part = 0; part < kParts; ++part) {
      const int i = block + part * kDoubles;
      const V3<double> q = load(f.q, i), p = load(f.p, i);
      V3<double> sum{};
      if (f.before) sum = load(f.out, i);
      for (const StiffRun& run : runs) {
        if (block_bits<double>(run.owners, i)) {
          const std::int64_t b = i + run.stride;
          add_stiff(run, i, q - load(f.q, b), p - load(f.p, b), sum);
        }
        if (i + kDoubles > run.stride) {
          const std::int64_t a = i - run.stride;
          add_stiff(run, a, q - load(f.q, a), p - load(f.p, a), sum);
        }
      }
      const unsigned free = block_bits<double>(f.free, i);
      const Doubles shift = load(f.shift + i), scale = splat<double>(f.scale);
      const Doubles x = keep(free, fma(scale, sum.x, shift * p.x));
      const Doubles y = keep(free, fma(scale, sum.y, shift * p.y));
      const Doubles z = keep(free, fma(scale, sum.z, shift * p.z));
      store(f.out[0] + i, x);
      store(f.out[1] + i, y);
      store(f.out[2] + i, z);
      dots[part] = fma(p.z, z, fma(p.y, y, fma(p.x, x, dots[part])));
    }
  add_lanes(dots, sums);
}

struct Symmetric {
  Doubles xx, xy, xz, yy, yz, zz;
};

SIM_INLINE void add_block(const StiffRun& run, std::int64_t at, const V3<double>& d,
                          Symmetric& sum) {
  const Doubles along = load(run.along + at), across = load(run.across + at);
  const Doubles x = across * d.x, y = across * d.y, z = across * d.z;
  sum.xx += fma(x, d.x, along);
  sum.xy = fma(x, d.y, sum.xy);
  sum.xz = fma(x, d.z, sum.xz);
  sum.yy += fma(y, d.y, along);
  sum.yz = fma(y, d.z, sum.yz);
  sum.zz += fma(z, d.z, along);
}

void stiff_diagonal(std::span<const StiffRun> runs, const double* const q[3], const double* shift,
                    double scale, double* const blocks[6], int begin, int end) {
  for (int i = begin; i < end; i += kDoubles) {
    const V3<double> here = load(q, i);
    Symmetric sum{};
    for (const StiffRun& run : runs) {
      if (block_bits<double>(run.owners, i)) add_block(run, i, here - load(q, i + run.stride), sum);
      if (i + kDoubles > run.stride)
        add_block(run, i - run.stride, here - load(q, i - run.stride), sum);
    }
    const Doubles m = load(shift + i), s = splat<double>(scale);
    store(blocks[0] + i, fma(s, sum.xx, m));
    store(blocks[1] + i, s * sum.xy);
    store(blocks[2] + i, s * sum.xz);
    store(blocks[3] + i, fma(s, sum.yy, m));
    store(blocks[4] + i, s * sum.yz);
    store(blocks[5] + i, fma(s, sum.zz, m));
  }
}

constexpr StiffKernels kStiff{linearise_run, add_pushes, soften_run, stiff_product, stiff_diagonal};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

StiffKernels stiff_kernels() { return SIM_CHOOSE(kStiff); }

}  // namespace sim
#endif
