// Vectors of doubles and floats of the instruction set at hand, SIM_BITS bits long. Only correctly
// rounded IEEE operations: every set gives the same bits. Fused multiply-add is one of them, where
// it is written and nowhere else; SSE2 has none and calls the C library's.
//
// Read once an instruction set, by core/simd/foreach_target.h.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

// The types of a vector of numbers, in a register and in memory at any address.
template <class Real>
struct VectorOf;
template <>
struct VectorOf<double> {
  typedef double Type __attribute__((vector_size(SIM_BITS / 8)));
  typedef double Unaligned
      __attribute__((vector_size(SIM_BITS / 8), aligned(sizeof(double)), may_alias));
};
template <>
struct VectorOf<float> {
  typedef float Type __attribute__((vector_size(SIM_BITS / 8)));
  typedef float Unaligned
      __attribute__((vector_size(SIM_BITS / 8), aligned(sizeof(float)), may_alias));
  typedef double Wide
      __attribute__((vector_size(SIM_BITS / 4), aligned(sizeof(double)), may_alias));
};

template <class Real>
using V = typename VectorOf<Real>::Type;
using Doubles = V<double>;
using Floats = V<float>;

template <class Real>
inline constexpr int kLanes = SIM_BITS / 8 / sizeof(Real);
inline constexpr int kDoubles = kLanes<double>;
using Mask = decltype(Doubles{} < Doubles{});  // of each lane all bits or none

template <class Real>
SIM_INLINE V<Real> load(const Real* p) {
  return *reinterpret_cast<const typename VectorOf<Real>::Unaligned*>(p);
}
template <class Real>
SIM_INLINE void store(Real* p, V<Real> v) {
  *reinterpret_cast<typename VectorOf<Real>::Unaligned*>(p) = v;
}
// Doubles in memory, rounded to floats: load<float>(p).
template <class Real>
requires std::is_same_v<Real, float> SIM_INLINE Floats load(const double* p) {
  return __builtin_convertvector(*reinterpret_cast<const VectorOf<float>::Wide*>(p), Floats);
}
SIM_INLINE void store(double* p, Floats v) {
  using Wide = VectorOf<float>::Wide;
  *reinterpret_cast<Wide*>(p) = __builtin_convertvector(v, Wide);
}
template <class Real>
SIM_INLINE V<Real> splat(double s) {
  return static_cast<Real>(s) - V<Real>{};
}

// N numbers side by side, in as many vectors as they take, which are loaded and stored whole.
template <int N>
struct Registers {
  static constexpr int kParts = (N + kDoubles - 1) / kDoubles;
  Doubles part[kParts];
};
template <int N>
SIM_INLINE Registers<N> load_registers(const double* p) {
  Registers<N> registers;
  for (int k = 0; k < registers.kParts; ++k) registers.part[k] = load(p + k * kDoubles);
  return registers;
}
template <int N>
SIM_INLINE void store(double* p, const Registers<N>& registers) {
  for (int k = 0; k < registers.kParts; ++k) store(p + k * kDoubles, registers.part[k]);
}

template <class Real>
struct V3 {
  V<Real> x, y, z;
};
template <class Real>
SIM_INLINE V3<Real> load(const Real* const p[3], std::int64_t i) {
  return {load(p[0] + i), load(p[1] + i), load(p[2] + i)};
}
template <class Real>
SIM_INLINE V3<Real> operator-(const V3<Real>& a, const V3<Real>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

// The bits of the lanes of a block of vectors that begins at particle i, a multiple of its lanes.
template <class Real, int N = 1>
SIM_INLINE unsigned block_bits(const std::uint8_t* bits, std::int64_t i) {
  constexpr int lanes = N * kLanes<Real>;
  if (lanes == 16) return bits[i >> 3] | unsigned{bits[(i >> 3) + 1]} << 8;
  if (lanes == 8) return bits[i >> 3];
  return bits[i >> 3] >> (i & 7) & ((1u << lanes) - 1);
}

// Adds the lanes of vectors that make up eight.
SIM_INLINE void add_lanes(const Doubles* vectors, double (&sums)[8]) {
  for (int lane = 0; lane < 8; ++lane) sums[lane] += vectors[lane / kDoubles][lane % kDoubles];
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_BITS == 512
#include "core/simd/vector_avx512.h"
#elif SIM_BITS == 256
#include "core/simd/vector_avx2.h"
#else
#if defined(__aarch64__)
#include "core/simd/vector_neon.h"
#elif defined(__wasm_simd128__)
#include "core/simd/vector_wasm.h"
#else
#include "core/simd/vector_sse2.h"
#endif
#include "core/simd/vector_pairs.h"
#endif

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

template <class Real>
SIM_INLINE V<Real> squared(const V3<Real>& d) {
  return fma(d.z, d.z, fma(d.y, d.y, d.x * d.x));
}

#if SIM_BITS == 128
// Writes first + lane to `out` for each lane of the bits in which v <= limit, in their order, and
// returns how many. May write as many entries as there are lanes.
SIM_INLINE int append_within(Doubles v, double limit, unsigned bits, int first, std::int32_t* out) {
  int count = 0;
  for (int lane = 0; lane < kDoubles; ++lane) {
    out[count] = first + lane;
    count += static_cast<int>(bits >> lane & 1) & (v[lane] <= limit);
  }
  return count;
}
#endif

// 1 / sqrt(v) = r (1 - e)^(-1/2) = r + r e (1/2 + 3/8 e) + O(e^3),  e = 1 - v r^2, for the seed r
// of v. At most 1 ulp off while e^2 <= kSeedError; a seed that failed has a larger one.
SIM_INLINE Doubles seed_error(Doubles v, Doubles r) { return fma(-(v * r), r, splat<double>(1)); }
SIM_INLINE Doubles refined(Doubles r, Doubles e) {
  return fma(r * e, fma(splat<double>(0.375), e, splat<double>(0.5)), r);
}

// 1 / sqrt(v), at most 1.5 ulp off for v > 0 that is neither subnormal nor infinite. The bits of v,
// halved and taken from a constant, give a seed r with |e| < 0.0702, e = 1 - v r^2 (Lomont, Fast
// inverse square root (2003)); then 1 / sqrt(v) = r (1 - e)^(-1/2) = r + r e p(e) with p from
// Remez' algorithm, relative error 2.6e-8.
SIM_INLINE Floats inverse_sqrt(Floats v) {
  typedef std::int32_t Bits __attribute__((vector_size(SIM_BITS / 8)));
  const Floats r = (Floats)(0x5f3759df - ((Bits)v >> 1));
  const Floats e = fma(-(v * r), r, splat<float>(1));
  const Floats p = fma(
      fma(fma(splat<float>(0.27456522), e, splat<float>(0.31400386)), e, splat<float>(0.37499893)),
      e, splat<float>(0.49999817));
  return fma(r * e, p, r);
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
