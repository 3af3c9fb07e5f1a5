// The part of core/simd/vector.h for one instruction set; core/simd/vector_sse2.h documents it. The
// masked forms with a full mask: g++ 12 warns of an undefined value inside the plain ones.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

SIM_INLINE Doubles fma(Doubles a, Doubles b, Doubles c) {
  return (Doubles)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c);
}
SIM_INLINE Floats fma(Floats a, Floats b, Floats c) {
  return (Floats)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
}

SIM_INLINE Doubles keep(unsigned bits, Doubles v) {
  return (Doubles)_mm512_maskz_mov_pd(static_cast<__mmask8>(bits), (__m512d)v);
}
SIM_INLINE Floats keep(unsigned bits, Floats v) {
  return (Floats)_mm512_maskz_mov_ps(static_cast<__mmask16>(bits), (__m512)v);
}

// A vector of the lanes of low and high side by side, from lane `first` on.
SIM_INLINE Doubles lanes_from(int first, Doubles low, Doubles high) {
  static constexpr std::int64_t kNumbers[16] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                8, 9, 10, 11, 12, 13, 14, 15};
  const __m512i lanes = _mm512_loadu_si512(kNumbers + first);
  return (Doubles)_mm512_permutex2var_pd((__m512d)low, lanes, (__m512d)high);
}
SIM_INLINE Floats lanes_from(int first, Floats low, Floats high) {
  static constexpr std::int32_t kNumbers[32] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10,
                                                11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21,
                                                22, 23, 24, 25, 26, 27, 28, 29, 30, 31};
  const __m512i lanes = _mm512_loadu_si512(kNumbers + first);
  return (Floats)_mm512_permutex2var_ps((__m512)low, lanes, (__m512)high);
}

SIM_INLINE Doubles square_root(Doubles v) {
  return (Doubles)_mm512_maskz_sqrt_pd(0xff, (__m512d)v);
}
SIM_INLINE Doubles seed(Doubles v) {
  const __m256 f = _mm512_maskz_cvtpd_ps(0xff, (__m512d)v);
  return (Doubles)_mm512_maskz_cvtps_pd(0xff, _mm256_div_ps(_mm256_set1_ps(1), _mm256_sqrt_ps(f)));
}
SIM_INLINE Doubles inverse_seed(Doubles v) {
  const __m256 f = _mm512_maskz_cvtpd_ps(0xff, (__m512d)v);
  return (Doubles)_mm512_maskz_cvtps_pd(0xff, _mm256_div_ps(_mm256_set1_ps(1), f));
}
SIM_INLINE Doubles add_square(unsigned bits, Doubles v, Doubles sum) {
  return (Doubles)_mm512_mask3_fmadd_pd((__m512d)v, (__m512d)v, (__m512d)sum,
                                        static_cast<__mmask8>(bits));
}
SIM_INLINE bool any_above(Doubles v, double limit) {
  return _mm512_cmp_pd_mask((__m512d)v, (__m512d)splat<double>(limit), _CMP_NLE_UQ) != 0;
}

SIM_INLINE unsigned bits_of(Mask m) { return _mm512_movepi64_mask((__m512i)m); }

// Loads and shuffles: gather instructions take three times as long.
SIM_INLINE V3<double> gather(const double* points, const std::int32_t* index, Doubles& fourth) {
  const auto pair = [&](int lane) __attribute__((always_inline)) {
    const __m256d low = _mm256_loadu_pd(points + 4 * std::ptrdiff_t{index[lane]});
    const __m256d high = _mm256_loadu_pd(points + 4 * std::ptrdiff_t{index[lane + 4]});
    return _mm512_maskz_insertf64x4(0xff, _mm512_castpd256_pd512(low), high, 1);
  };
  const __m512d p0 = pair(0), p1 = pair(1), p2 = pair(2), p3 = pair(3);
  const __m512i firsts = _mm512_set_epi64(13, 12, 5, 4, 9, 8, 1, 0);
  const __m512i seconds = _mm512_set_epi64(15, 14, 7, 6, 11, 10, 3, 2);
  const __m512d xz01 = _mm512_maskz_unpacklo_pd(0xff, p0, p1);
  const __m512d xz23 = _mm512_maskz_unpacklo_pd(0xff, p2, p3);
  const __m512d y01 = _mm512_maskz_unpackhi_pd(0xff, p0, p1);
  const __m512d y23 = _mm512_maskz_unpackhi_pd(0xff, p2, p3);
  fourth = (Doubles)_mm512_permutex2var_pd(y01, seconds, y23);
  return {(Doubles)_mm512_permutex2var_pd(xz01, firsts, xz23),
          (Doubles)_mm512_permutex2var_pd(y01, firsts, y23),
          (Doubles)_mm512_permutex2var_pd(xz01, seconds, xz23)};
}
SIM_INLINE V3<double> gather(const double* points, const std::int32_t* index) {
  Doubles fourth;
  return gather(points, index, fourth);
}

SIM_INLINE int append_within(Doubles v, double limit, unsigned bits, int first, std::int32_t* out) {
  const __mmask8 near = _mm512_mask_cmp_pd_mask(static_cast<__mmask8>(bits), (__m512d)v,
                                                (__m512d)splat<double>(limit), _CMP_LE_OQ);
  const __m256i lanes =
      _mm256_add_epi32(_mm256_set1_epi32(first), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(out), _mm256_maskz_compress_epi32(near, lanes));
  return __builtin_popcount(near);
}

SIM_INLINE Floats greater(Floats a, Floats b) {
  return (Floats)_mm512_maskz_max_ps(0xffff, (__m512)a, (__m512)b);
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
