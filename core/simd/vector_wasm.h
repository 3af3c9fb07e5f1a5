// The part of core/simd/vector.h for WebAssembly; core/simd/vector_sse2.h documents it.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

SIM_INLINE Doubles fma(Doubles a, Doubles b, Doubles c) {
  return (Doubles)sim_fma_doubles((v128_t)a, (v128_t)b, (v128_t)c);
}
SIM_INLINE Floats fma(Floats a, Floats b, Floats c) {
  return (Floats)sim_fma_floats((v128_t)a, (v128_t)b, (v128_t)c);
}

SIM_INLINE Doubles keep(unsigned bits, Doubles v) {
  const v128_t lane = wasm_i64x2_const(1, 2);
  const v128_t set = wasm_v128_and(wasm_i64x2_splat(bits), lane);
  return (Doubles)wasm_v128_and(wasm_i64x2_eq(set, lane), (v128_t)v);
}
SIM_INLINE Floats keep(unsigned bits, Floats v) {
  const v128_t lane = wasm_i32x4_const(1, 2, 4, 8);
  const v128_t set = wasm_v128_and(wasm_i32x4_splat(static_cast<int>(bits)), lane);
  return (Floats)wasm_v128_and(wasm_i32x4_eq(set, lane), (v128_t)v);
}

SIM_INLINE Doubles square_root(Doubles v) { return (Doubles)wasm_f64x2_sqrt((v128_t)v); }
// The upper lanes divide by zero, which costs nothing and is left out again.
SIM_INLINE Doubles seed(Doubles v) {
  const v128_t f = wasm_f32x4_demote_f64x2_zero((v128_t)v);
  return (Doubles)wasm_f64x2_promote_low_f32x4(
      wasm_f32x4_div(wasm_f32x4_const_splat(1), wasm_f32x4_sqrt(f)));
}
SIM_INLINE Doubles inverse_seed(Doubles v) {
  const v128_t f = wasm_f32x4_demote_f64x2_zero((v128_t)v);
  return (Doubles)wasm_f64x2_promote_low_f32x4(wasm_f32x4_div(wasm_f32x4_const_splat(1), f));
}
SIM_INLINE bool any_above(Doubles v, double limit) {
  return !wasm_i64x2_all_true(wasm_f64x2_le((v128_t)v, wasm_f64x2_splat(limit)));
}

SIM_INLINE unsigned bits_of(Mask m) { return static_cast<unsigned>(wasm_i64x2_bitmask((v128_t)m)); }

// pmax(b, a) is b < a ? a : b.
SIM_INLINE Floats greater(Floats a, Floats b) {
  return (Floats)wasm_f32x4_pmax((v128_t)b, (v128_t)a);
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
