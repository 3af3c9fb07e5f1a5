// The part of core/simd/vector.h for one instruction set; core/simd/vector_pairs.h has the rest.
// 128 bits with and without FMA.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

// a b + c, rounded once.
#if SIM_FMA
SIM_INLINE Doubles fma(Doubles a, Doubles b, Doubles c) {
  return (Doubles)_mm_fmadd_pd((__m128d)a, (__m128d)b, (__m128d)c);
}
SIM_INLINE Floats fma(Floats a, Floats b, Floats c) {
  return (Floats)_mm_fmadd_ps((__m128)a, (__m128)b, (__m128)c);
}
#else
SIM_INLINE Doubles fma(Doubles a, Doubles b, Doubles c) {
  return Doubles{std::fma(a[0], b[0], c[0]), std::fma(a[1], b[1], c[1])};
}
SIM_INLINE Floats fma(Floats a, Floats b, Floats c) {
  Floats sum;
  for (int lane = 0; lane < kLanes<float>; ++lane) sum[lane] = std::fma(a[lane], b[lane], c[lane]);
  return sum;
}
#endif

// v where the bit of the lane is set, 0 elsewhere.
SIM_INLINE Doubles keep(unsigned bits, Doubles v) {
  const __m128i set =
      _mm_set_epi64x(-static_cast<long long>(bits >> 1 & 1), -static_cast<long long>(bits & 1));
  return (Doubles)_mm_and_pd(_mm_castsi128_pd(set), (__m128d)v);
}
SIM_INLINE Floats keep(unsigned bits, Floats v) {
  const __m128i lane = _mm_set_epi32(8, 4, 2, 1);
  const __m128i set = _mm_and_si128(_mm_set1_epi32(static_cast<int>(bits)), lane);
  return (Floats)_mm_and_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(set, lane)), (__m128)v);
}

SIM_INLINE Doubles square_root(Doubles v) { return (Doubles)_mm_sqrt_pd((__m128d)v); }

// 1 / sqrt(v) to single precision: conversion, square root and division of IEEE single precision.
SIM_INLINE Doubles seed(Doubles v) {
  const __m128 f = _mm_cvtpd_ps((__m128d)v);
  const __m128 two = _mm_movelh_ps(f, f);  // the upper lanes must not divide by zero
  return (Doubles)_mm_cvtps_pd(_mm_div_ps(_mm_set1_ps(1), _mm_sqrt_ps(two)));
}

// True if any lane is greater than the limit, or not a number.
// 1 / v likewise.
SIM_INLINE Doubles inverse_seed(Doubles v) {
  const __m128 f = _mm_cvtpd_ps((__m128d)v);
  return (Doubles)_mm_cvtps_pd(_mm_div_ps(_mm_set1_ps(1), _mm_movelh_ps(f, f)));
}

SIM_INLINE bool any_above(Doubles v, double limit) {
  return _mm_movemask_pd(_mm_cmpnle_pd((__m128d)v, (__m128d)splat<double>(limit))) != 0;
}

// A bit a lane.
SIM_INLINE unsigned bits_of(Mask m) { return static_cast<unsigned>(_mm_movemask_pd((__m128d)m)); }

// The greater one, b where one is not a number.
SIM_INLINE Floats greater(Floats a, Floats b) { return (Floats)_mm_max_ps((__m128)a, (__m128)b); }

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
