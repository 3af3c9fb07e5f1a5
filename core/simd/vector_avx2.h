// The part of core/simd/vector.h for one instruction set; core/simd/vector_sse2.h documents it.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

SIM_INLINE Doubles fma(Doubles a, Doubles b, Doubles c) {
  return (Doubles)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
}
SIM_INLINE Floats fma(Floats a, Floats b, Floats c) {
  return (Floats)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
}

// For four bits a byte of ones or zeros each.
inline constexpr std::uint32_t kBytesOfBits[16] = {
    0x00000000, 0x000000ff, 0x0000ff00, 0x0000ffff, 0x00ff0000, 0x00ff00ff, 0x00ffff00, 0x00ffffff,
    0xff000000, 0xff0000ff, 0xff00ff00, 0xff00ffff, 0xffff0000, 0xffff00ff, 0xffffff00, 0xffffffff};

SIM_INLINE Doubles keep(unsigned bits, Doubles v) {
  if (__builtin_constant_p(bits) && (bits & 15) == 15) return v;
  const __m256i set = _mm256_cvtepi8_epi64(_mm_loadu_si32(kBytesOfBits + (bits & 15)));
  return (Doubles)_mm256_and_pd(_mm256_castsi256_pd(set), (__m256d)v);
}
SIM_INLINE Floats keep(unsigned bits, Floats v) {
  const __m256i lane = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
  const __m256i set = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), lane);
  return (Floats)_mm256_and_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane)), (__m256)v);
}

SIM_INLINE Doubles square_root(Doubles v) { return (Doubles)_mm256_sqrt_pd((__m256d)v); }
SIM_INLINE Doubles seed(Doubles v) {
  const __m128 f = _mm256_cvtpd_ps((__m256d)v);
  return (Doubles)_mm256_cvtps_pd(_mm_div_ps(_mm_set1_ps(1), _mm_sqrt_ps(f)));
}
SIM_INLINE Doubles inverse_seed(Doubles v) {
  return (Doubles)_mm256_cvtps_pd(_mm_div_ps(_mm_set1_ps(1), _mm256_cvtpd_ps((__m256d)v)));
}
SIM_INLINE Doubles add_square(unsigned bits, Doubles v, Doubles sum) {
  const Doubles kept = keep(bits, v);
  return fma(kept, kept, sum);
}
SIM_INLINE bool any_above(Doubles v, double limit) {
  const __m256d above = _mm256_cmp_pd((__m256d)v, (__m256d)splat<double>(limit), _CMP_NLE_UQ);
  return _mm256_movemask_pd(above) != 0;
}

SIM_INLINE unsigned bits_of(Mask m) {
  return static_cast<unsigned>(_mm256_movemask_pd((__m256d)m));
}

// Halves of points, 0 and 2 beside 1 and 3: gather instructions take longer, and so do numbers one
// by one.
SIM_INLINE V3<double> gather(const double* points, const std::int32_t* index, Doubles& fourth) {
  const auto halves = [&](int lane, int first) __attribute__((always_inline)) {
    const double* const low = points + 4 * std::ptrdiff_t{index[lane]} + first;
    const double* const high = points + 4 * std::ptrdiff_t{index[lane + 2]} + first;
    return _mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(low)), _mm_loadu_pd(high), 1);
  };
  const __m256d xy02 = halves(0, 0), xy13 = halves(1, 0), z02 = halves(0, 2), z13 = halves(1, 2);
  fourth = (Doubles)_mm256_unpackhi_pd(z02, z13);
  return {(Doubles)_mm256_unpacklo_pd(xy02, xy13), (Doubles)_mm256_unpackhi_pd(xy02, xy13),
          (Doubles)_mm256_unpacklo_pd(z02, z13)};
}
SIM_INLINE V3<double> gather(const double* points, const std::int32_t* index) {
  Doubles fourth;
  return gather(points, index, fourth);
}

// For four bits the bytes of the lanes that are set, packed.
struct PackedLanes {
  std::int8_t bytes[16][4];
};
inline constexpr PackedLanes kPackedLanes = [] {
  PackedLanes packed{};
  for (int bits = 0; bits < 16; ++bits)
    for (int lane = 0, count = 0; lane < 4; ++lane)
      if (bits >> lane & 1) packed.bytes[bits][count++] = static_cast<std::int8_t>(lane);
  return packed;
}();

SIM_INLINE int append_within(Doubles v, double limit, unsigned bits, int first, std::int32_t* out) {
  bits &= bits_of(v <= splat<double>(limit));
  const __m128i lanes = _mm_cvtepi8_epi32(_mm_loadu_si32(kPackedLanes.bytes[bits]));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(out), _mm_add_epi32(_mm_set1_epi32(first), lanes));
  return __builtin_popcount(bits);
}

SIM_INLINE Floats greater(Floats a, Floats b) {
  return (Floats)_mm256_max_ps((__m256)a, (__m256)b);
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
