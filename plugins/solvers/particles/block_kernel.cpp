#include "block_kernels.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "block_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

void invert_blocks(const double* const blocks[6], const std::uint8_t* free,
                   double* const inverses[6], int begin, int end) {
  const Doubles zero{}, one = splat<double>(1);
  for (int i = begin; i < end; i += kDoubles) {
    Doubles xx = load(blocks[0] + i), xy = load(blocks[1] + i), xz = load(blocks[2] + i);
    Doubles yy = load(blocks[3] + i), yz = load(blocks[4] + i), zz = load(blocks[5] + i);
    // Scaled to a trace of 1, so that no product overflows or underflows.
    const Doubles trace = xx + yy + zz;
    const Doubles size = trace < zero ? -trace : trace;
    const Doubles scale = one / (size > zero ? size : one);
    xx *= scale, xy *= scale, xz *= scale, yy *= scale, yz *= scale, zz *= scale;
    const Doubles cx = fma(yy, zz, -(yz * yz)), cy = fma(xz, yz, -(xy * zz));
    const Doubles cz = fma(xy, yz, -(xz * yy));
    const Doubles det = fma(xz, cz, fma(xy, cy, xx * cx));
    const Doubles minor = fma(xx, yy, -(xy * xy));
    // Sylvester's criterion, with a margin for rounding errors.
    const Doubles least = splat<double>(1e-14);
    Doubles good = xx > zero ? one : zero;
    good = minor > zero ? good : zero;
    good = det > least * xx * yy * zz ? good : zero;
    const Doubles factor = scale / (good > zero ? det : one);
    const auto put = [&](int entry, Doubles cofactor, Doubles otherwise)
        __attribute__((always_inline)) {
      const unsigned bits = block_bits<double>(free, i);
      store(inverses[entry] + i, keep(bits, good > zero ? cofactor * factor : otherwise));
    };
    put(0, cx, scale);
    put(1, cy, zero);
    put(2, cz, zero);
    put(3, fma(xx, zz, -(xz * xz)), scale);
    put(4, fma(xy, xz, -(xx * yz)), zero);
    put(5, minor, scale);
  }
}

// z = inverse r at one block of eight nodes; adds r.z.
SIM_INLINE void multiply_block(const double* const inverses[6], int i, Doubles x, Doubles y,
                               Doubles z, double* const out[3], Doubles& dot) {
  const Doubles xx = load(inverses[0] + i), xy = load(inverses[1] + i), xz = load(inverses[2] + i);
  const Doubles yy = load(inverses[3] + i), yz = load(inverses[4] + i), zz = load(inverses[5] + i);
  const Doubles zx = fma(xz, z, fma(xy, y, xx * x));
  const Doubles zy = fma(yz, z, fma(yy, y, xy * x));
  const Doubles z_z = fma(zz, z, fma(yz, y, xz * x));
  store(out[0] + i, zx);
  store(out[1] + i, zy);
  store(out[2] + i, z_z);
  dot = fma(z, z_z, fma(y, zy, fma(x, zx, dot)));
}

void multiply_blocks(const double* const inverses[6], const double* const r[3], double* const z[3],
                     int begin, int end, double (&sums)[8]) {
  Doubles dots[8 / kDoubles] = {};
  for (int block = begin; block < end; block += 8)
    for (int part = 0; part < 8 / kDoubles; ++part) {
      const int i = block + part * kDoubles;
      multiply_block(inverses, i, load(r[0] + i), load(r[1] + i), load(r[2] + i), z, dots[part]);
    }
  add_lanes(dots, sums);
}

void advance(double alpha, const double* const p[3], const double* const a[3], double* const d[3],
             double* const r[3], const double* const inverses[6], double* const z[3], int begin,
             int end, double (&sums)[8]) {
  Doubles dots[8 / kDoubles] = {};
  const Doubles plus = splat<double>(alpha), minus = splat<double>(-alpha);
  for (int block = begin; block < end; block += 8)
    for (int part = 0; part < 8 / kDoubles; ++part) {
      const int i = block + part * kDoubles;
      Doubles rest[3];
      for (int axis = 0; axis < 3; ++axis) {
        store(d[axis] + i, fma(plus, load(p[axis] + i), load(d[axis] + i)));
        rest[axis] = fma(minus, load(a[axis] + i), load(r[axis] + i));
        store(r[axis] + i, rest[axis]);
      }
      multiply_block(inverses, i, rest[0], rest[1], rest[2], z, dots[part]);
    }
  add_lanes(dots, sums);
}

// `size` is a multiple of 8, as in every layout.
void dot(const double* a, const double* b, std::size_t size, double (&sums)[8]) {
  Doubles dots[8 / kDoubles] = {};
  for (std::size_t block = 0; block < size; block += 8)
    for (int part = 0; part < 8 / kDoubles; ++part) {
      const std::size_t i = block + static_cast<std::size_t>(part * kDoubles);
      dots[part] += load(a + i) * load(b + i);
    }
  add_lanes(dots, sums);
}

void turn(double beta, const double* const z[3], double* const p[3], int begin, int end) {
  const Doubles factor = splat<double>(beta);
  for (int axis = 0; axis < 3; ++axis)
    for (int i = begin; i < end; i += kDoubles)
      store(p[axis] + i, fma(factor, load(p[axis] + i), load(z[axis] + i)));
}

constexpr BlockKernels kBlocks{invert_blocks, multiply_blocks, advance, dot, turn};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

BlockKernels block_kernels() { return SIM_CHOOSE(kBlocks); }

}  // namespace sim
#endif
