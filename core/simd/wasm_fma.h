// Fused multiply-add on WebAssembly, which has no instruction for it that is sure to round once.
#pragma once

#include <wasm_simd128.h>

// a b + c of each lane, rounded once, from sums, products and bits. A call of these has the
// operands and the result of f64x2.relaxed_madd and f32x4.relaxed_madd: cli/web/fuse.py puts the
// instruction in the place of each call, for machines where it rounds once too.
extern "C" {
v128_t sim_fma_doubles(v128_t a, v128_t b, v128_t c) __attribute__((const));
v128_t sim_fma_floats(v128_t a, v128_t b, v128_t c) __attribute__((const));
}
