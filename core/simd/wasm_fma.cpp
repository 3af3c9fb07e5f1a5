#if defined(__wasm_simd128__)

#include "core/simd/wasm_fma.h"

#include <cmath>
#include <cstdint>

namespace {

typedef double Doubles __attribute__((vector_size(16)));
typedef float Floats __attribute__((vector_size(16)));
typedef std::int64_t Bits __attribute__((vector_size(16)));

struct Sum {
  Doubles value, error;  // value + error is the exact sum
};

// Knuth (1969).
inline Sum two_sum(Doubles a, Doubles b) {
  const Doubles s = a + b, z = s - a;
  return {s, (a - (s - z)) + (b - z)};
}

// The upper 26 bits of the significand, rounded: what is left has 26 bits with its sign.
inline Doubles upper_half(Doubles a) {
  return (Doubles)(((Bits)a + 0x4000000) & ~std::int64_t{0x7ffffff});
}

inline Doubles size_of(Doubles a) { return (Doubles)((Bits)a & INT64_MAX); }

// By the C library, but for a product that vanishes beside 0: musl loses its sign.
double by_library(double a, double b, double c) {
  return c == 0 && a != 0 && b != 0 ? a * b : std::fma(a, b, c);
}

__attribute__((noinline)) v128_t by_lanes(Doubles a, Doubles b, Doubles c) {
  return (v128_t)Doubles{by_library(a[0], b[0], c[0]), by_library(a[1], b[1], c[1])};
}

}  // namespace

// The product is p + e exactly (Dekker 1971), p + c is s + d exactly; v = d + e is off by at most
// half its last bit, so that s + v rounds as the exact sum does wherever neighbours of v on both
// sides give the same (Ziv 1991). Where they do not, or where a part of it may overflow or
// underflow, the lanes are done by hand; a product with 0 is exact.
extern "C" v128_t sim_fma_doubles(v128_t x, v128_t y, v128_t z) {
  const Doubles a = (Doubles)x, b = (Doubles)y, c = (Doubles)z;
  const Doubles ah = upper_half(a), al = a - ah, bh = upper_half(b), bl = b - bh;
  const Doubles p = a * b, e = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
  const Sum sum = two_sum(p, c);
  const Doubles v = sum.error + e;
  const Doubles above = sum.value + v * (1 + 0x1p-51), below = sum.value + v * (1 - 0x1p-51);
  const Doubles least = 0x1p-900 - Doubles{}, most = 0x1p900 - Doubles{};
  const Doubles size = size_of(p);
  const Bits sure = (Bits)(above == below) & (Bits)(size_of(c) < most) & (Bits)(size < most) &
                    ((Bits)(size > least) | (Bits)(a == 0) | (Bits)(b == 0)) &
                    (Bits)(size_of(a) < most) & (Bits)(size_of(b) < most);
  if (__builtin_expect(!wasm_i64x2_all_true((v128_t)sure), 0)) return by_lanes(a, b, c);
  // Without a rest the sum has the right sign where it is 0.
  return wasm_v128_bitselect((v128_t)sum.value, (v128_t)above, (v128_t)(v == 0));
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
