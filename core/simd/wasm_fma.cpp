#if defined(__wasm_simd128__)

#include "core/simd/wasm_fma.h"

#include <cmath>
#include <cstdint>

typedef double Doubles __attribute__((vector_size(16)));
typedef float Floats __attribute__((vector_size(16)));
typedef std::int64_t Bits __attribute__((vector_size(16)));

// Engines build a constant vector from its halves each time, so these are read from memory: what is
// not constant is not folded into the code.
extern "C" {
Bits sim_fma_half{0x4000000, 0x4000000};
Bits sim_fma_upper{~0x7ffffffLL, ~0x7ffffffLL};
Doubles sim_fma_above{1 + 0x1p-51, 1 + 0x1p-51};
Doubles sim_fma_below{1 - 0x1p-51, 1 - 0x1p-51};
Doubles sim_fma_least{0x1p-900, 0x1p-900};
}

namespace {

// The upper 26 bits of the significand, rounded: what is left has 26 bits with its sign.
inline Doubles upper_half(Doubles a) { return (Doubles)(((Bits)a + sim_fma_half) & sim_fma_upper); }

inline bool any(Bits bits) { return wasm_v128_any_true((v128_t)bits); }

// By the C library, but for a product that vanishes beside 0: musl loses its sign.
double by_library(double a, double b, double c) {
  return c == 0 && a != 0 && b != 0 ? a * b : std::fma(a, b, c);
}

__attribute__((noinline)) v128_t by_lanes(Doubles a, Doubles b, Doubles c) {
  return (v128_t)Doubles{by_library(a[0], b[0], c[0]), by_library(a[1], b[1], c[1])};
}

}  // namespace

// The product is p - e exactly (Dekker 1971), p + c is s - d exactly (Knuth 1969); v = d + e is off
// by at most half its last bit, so that s - v rounds as the exact sum does wherever numbers around
// v on both sides give the same (Ziv 1991). Where they do not, or where parts of the product may
// underflow, the lanes are done by hand; what overflows is no number, and differs from itself. A
// product with 0 is exact. Where all is 0, v is +0 and s has the right sign.
extern "C" v128_t sim_fma_doubles(v128_t x, v128_t y, v128_t z) {
  const Doubles a = (Doubles)x, b = (Doubles)y, c = (Doubles)z;
  const Doubles ah = upper_half(a), al = a - ah, bh = upper_half(b), bl = b - bh;
  const Doubles p = a * b, e = ((p - ah * bh) - ah * bl - al * bh) - al * bl;
  const Doubles s = p + c, t = s - p, d = ((s - t) - p) + (t - c);
  const Doubles v = d + e;
  const Doubles above = s - v * sim_fma_above, below = s - v * sim_fma_below;
  const Bits unsure = (Bits)(above != below), small = (Bits)(p * p <= sim_fma_least);
  if (__builtin_expect(any(unsure | small), 0) &&
      any(unsure | (small & (Bits)(a != 0) & (Bits)(b != 0))))
    return by_lanes(a, b, c);
  return (v128_t)above;
}

// The product is exact in double precision; the sum is rounded to odd there, so that rounding it
// again to single precision is as rounding once (Boldo and Melquiond 2008).
extern "C" v128_t sim_fma_floats(v128_t x, v128_t y, v128_t z) {
  const Floats a = (Floats)x, b = (Floats)y, c = (Floats)z;
  Floats result;
  for (int lane = 0; lane < 4; ++lane) {
    const double p = static_cast<double>(a[lane]) * b[lane], d = c[lane], s = p + d, t = s - p;
    const double error = (p - (s - t)) + (d - t);
    std::int64_t bits = __builtin_bit_cast(std::int64_t, s);
    if (error != 0 && error == error && !(bits & 1)) bits += (error > 0) == (s > 0) ? 1 : -1;
    result[lane] = static_cast<float>(__builtin_bit_cast(double, bits));
  }
  return (v128_t)result;
}

#endif
