// The part of core/simd/vector.h for one instruction set; core/simd/vector_sse2.h documents it.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

SIM_INLINE Doubles fma(Doubles a, Doubles b, Doubles c) {
  return (Doubles)vfmaq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b);
}
SIM_INLINE Floats fma(Floats a, Floats b, Floats c) {
  return (Floats)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b);
}

SIM_INLINE Doubles keep(unsigned bits, Doubles v) {
  static constexpr std::uint64_t kBits[2] = {1, 2};
  const uint64x2_t set = vtstq_u64(vdupq_n_u64(bits), vld1q_u64(kBits));
  return (Doubles)vandq_u64(set, (uint64x2_t)v);
}
SIM_INLINE Floats keep(unsigned bits, Floats v) {
  static constexpr std::uint32_t kBits[4] = {1, 2, 4, 8};
  const uint32x4_t set = vtstq_u32(vdupq_n_u32(bits), vld1q_u32(kBits));
  return (Floats)vandq_u32(set, (uint32x4_t)v);
}

SIM_INLINE Doubles square_root(Doubles v) { return (Doubles)vsqrtq_f64((float64x2_t)v); }
SIM_INLINE Doubles seed(Doubles v) {
  const float32x2_t f = vcvt_f32_f64((float64x2_t)v);
  return (Doubles)vcvt_f64_f32(vdiv_f32(vdup_n_f32(1), vsqrt_f32(f)));
}
SIM_INLINE Doubles inverse_seed(Doubles v) {
  return (Doubles)vcvt_f64_f32(vdiv_f32(vdup_n_f32(1), vcvt_f32_f64((float64x2_t)v)));
}
SIM_INLINE bool any_above(Doubles v, double limit) { return !(v[0] <= limit && v[1] <= limit); }

SIM_INLINE unsigned bits_of(Mask m) { return static_cast<unsigned>((m[0] & 1) | (m[1] & 1) << 1); }

// The instruction for a maximum gives NaN where one is not a number.
SIM_INLINE Floats greater(Floats a, Floats b) { return a > b ? a : b; }

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
