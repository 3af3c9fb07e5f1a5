// Elementary functions of vectors from sums, products and quotients alone.
//
// Read once an instruction set, behind core/simd/foreach_target.h.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

typedef std::uint64_t U __attribute__((vector_size(SIM_BITS / 8)));

SIM_INLINE U bits_of(Doubles v) { return (U)v; }
SIM_INLINE Doubles magnitude(Doubles v) {
  return (Doubles)(bits_of(v) & ~(std::uint64_t{1} << 63));
}
SIM_INLINE Doubles with_sign_of(Doubles size, Doubles sign) {
  return (Doubles)(bits_of(size) | (bits_of(sign) & (std::uint64_t{1} << 63)));
}
SIM_INLINE Doubles not_a_number() {
  return splat<double>(std::numeric_limits<double>::quiet_NaN());
}
SIM_INLINE Doubles infinity() { return splat<double>(std::numeric_limits<double>::infinity()); }
SIM_INLINE Doubles at_most(Doubles v, double most) {
  return v > splat<double>(most) ? splat<double>(most) : v;
}
SIM_INLINE Doubles at_least(Doubles v, double least) {
  return v < splat<double>(least) ? splat<double>(least) : v;
}

// v + kRound has v, rounded to a whole number of less than 2^51, in its lowest bits.
inline constexpr double kRound = 0x1.8p52;
SIM_INLINE Doubles rounded(Doubles v) {
  return (v + splat<double>(kRound)) - splat<double>(kRound);
}

SIM_INLINE Doubles floor_of(Doubles v) {
  const Doubles near =
      with_sign_of((magnitude(v) + splat<double>(0x1p52)) - splat<double>(0x1p52), v);
  const Doubles below = near > v ? near - splat<double>(1) : near;
  return magnitude(v) < splat<double>(0x1p52) ? below : v;
}

// 2^k for whole k from -1022 to 1023.
SIM_INLINE Doubles power_of_two(Doubles k) {
  return (Doubles)((bits_of(k + splat<double>(kRound)) + 1023) << 52);
}

// c[0] + c[1] x + ... by Horner's rule.
template <int N>
SIM_INLINE Doubles polynomial(const double (&c)[N], Doubles x) {
  Doubles sum = splat<double>(c[N - 1]);
  for (int i = N - 2; i >= 0; --i) sum = sum * x + splat<double>(c[i]);
  return sum;
}

inline constexpr double kFactorials[] = {1,
                                         1,
                                         2,
                                         6,
                                         24,
                                         120,
                                         720,
                                         5040,
                                         40320,
                                         362880,
                                         3628800,
                                         39916800,
                                         479001600,
                                         6227020800,
                                         87178291200,
                                         1307674368000,
                                         20922789888000,
                                         355687428096000};

// x = k log 2 + r with |r| <= log 2 / 2 (Cody & Waite 1980): k log 2 in two parts, the first exact.
struct Reduced {
  Doubles k, r;
};
SIM_INLINE Reduced by_log2(Doubles x) {
  const Doubles k = rounded(x * splat<double>(0x1.71547652b82fep+0));
  return {k, (x - k * splat<double>(0x1.62e42fefa2p-1)) - k * splat<double>(0x1.9ef35793c7673p-41)};
}

// e^r - 1 by its Taylor series to r^13, for |r| <= log 2 / 2.
SIM_INLINE Doubles exp_minus_one(Doubles r) {
  constexpr const double* kF = kFactorials;
  constexpr double kTerms[] = {1 / kF[2],  1 / kF[3],  1 / kF[4],  1 / kF[5],
                               1 / kF[6],  1 / kF[7],  1 / kF[8],  1 / kF[9],
                               1 / kF[10], 1 / kF[11], 1 / kF[12], 1 / kF[13]};
  return r + (r * r) * polynomial(kTerms, r);
}

SIM_INLINE Doubles exp_of(Doubles x) {
  const Reduced x_of = by_log2(at_least(at_most(x, 710), -746));
  // 2^k in two factors, for the result may be subnormal.
  const Doubles half = rounded(splat<double>(0.5) * x_of.k);
  return (exp_minus_one(x_of.r) + splat<double>(1)) * power_of_two(half) *
         power_of_two(x_of.k - half);
}

// e^x - 1 for |x| <= 60.
SIM_INLINE Doubles expm1_of(Doubles x) {
  const Reduced x_of = by_log2(x);
  const Doubles scale = power_of_two(x_of.k);
  return scale * exp_minus_one(x_of.r) + (scale - splat<double>(1));
}

// x = 2^k (1 + f) with 1 + f from sqrt(1/2) to sqrt(2); with s = f / (2 + f)
//   log(1 + f) = 2 atanh(s) = f - f^2/2 + s (f^2/2 + R),  R = 2/3 s^2 + 2/5 s^4 + ...
SIM_INLINE Doubles log_of(Doubles x) {
  constexpr std::uint64_t kRootHalf = 0x3fe6a09e667f3bcd;  // sqrt(1/2)
  const auto small = x < splat<double>(0x1p-1022);
  const Doubles y = small ? x * splat<double>(0x1p54) : x;
  const U biased = (bits_of(y) - kRootHalf + (std::uint64_t{1023} << 52)) >> 52;
  const Doubles f = (Doubles)(bits_of(y) - ((biased - 1023) << 52)) - splat<double>(1);
  const Doubles k = (Doubles)(biased | (std::uint64_t{0x433} << 52)) -
                    (small ? splat<double>(0x1p52 + 1023 + 54) : splat<double>(0x1p52 + 1023));

  constexpr double kTerms[] = {2 / 3.0,  2 / 5.0,  2 / 7.0,  2 / 9.0,  2 / 11.0,
                               2 / 13.0, 2 / 15.0, 2 / 17.0, 2 / 19.0, 2 / 21.0};
  const Doubles s = f / (splat<double>(2) + f), z = s * s, half = splat<double>(0.5) * f * f;
  const Doubles rest = z * polynomial(kTerms, z);
  const Doubles low = s * (half + rest) + k * splat<double>(0x1.9ef35793c7673p-41);
  const Doubles result = k * splat<double>(0x1.62e42fefa2p-1) - ((half - low) - f);
  const Doubles beyond = x < infinity() ? result : x;  // infinity, not a number
  return x > splat<double>(0) ? beyond : (x == splat<double>(0) ? -infinity() : not_a_number());
}

// Sine and cosine. x = q pi/2 + r + tail with |r| <= pi/4: q times each of the first three parts of
// pi/2, of 22 bits, is exact for |x| < 1e9.
struct SineCosine {
  Doubles sine, cosine;
};
SIM_INLINE SineCosine sine_cosine(Doubles x) {
  const Doubles q = rounded(x * splat<double>(0x1.45f306dc9c883p-1));
  const Doubles first = (x - q * splat<double>(0x1.921fbp+0)) - q * splat<double>(0x1.5110bp-22);
  const Doubles third = q * splat<double>(0x1.1846980000000p-44);
  const Doubles near = first - third;
  const Doubles back = first - near;
  const Doubles lost = (first - (near + back)) + (back - third);  // first - third - near, exactly
  const Doubles more = lost - q * splat<double>(0x1.3198a2e037073p-69);
  const Doubles r = near + more, tail = (near - r) + more;

  constexpr const double* kF = kFactorials;
  constexpr double kSine[] = {-1 / kF[3],  1 / kF[5],  -1 / kF[7],  1 / kF[9],
                              -1 / kF[11], 1 / kF[13], -1 / kF[15], 1 / kF[17]};
  constexpr double kCosine[] = {1 / kF[4],  -1 / kF[6],  1 / kF[8], -1 / kF[10],
                                1 / kF[12], -1 / kF[14], 1 / kF[16]};
  const Doubles z = r * r, half = splat<double>(0.5) * z, one = splat<double>(1) - half;
  const Doubles sine = r + (r * z * polynomial(kSine, z) + tail * one);
  const Doubles cosine =
      one + (((splat<double>(1) - one) - half) + (z * z * polynomial(kCosine, z) - r * tail));

  // Quadrants: (s, c), (c, -s), (-s, -c), (-c, s).
  const U quadrant = bits_of(q + splat<double>(kRound));
  const auto odd = (quadrant & 1) != 0;
  const U sine_sign = (quadrant & 2) << 62, cosine_sign = ((quadrant + 1) & 2) << 62;
  const auto known = magnitude(x) < splat<double>(1e9);
  const Doubles s = (Doubles)(bits_of(odd ? cosine : sine) ^ sine_sign);
  const Doubles c = (Doubles)(bits_of(odd ? sine : cosine) ^ cosine_sign);
  return {known ? s : not_a_number(), known ? c : not_a_number()};
}

SIM_INLINE Doubles tan_of(Doubles x) {
  const SineCosine both = sine_cosine(x);
  return both.sine / both.cosine;
}

SIM_INLINE Doubles sinh_of(Doubles x) {
  const Doubles size = magnitude(x), e = expm1_of(at_most(size, 40));
  const Doubles sinh = size < splat<double>(40)
                           ? splat<double>(0.5) * (e + e / (e + splat<double>(1)))
                           : splat<double>(0.5) * exp_of(size);
  return with_sign_of(sinh, x);
}

SIM_INLINE Doubles cosh_of(Doubles x) {
  const Doubles e = exp_of(magnitude(x));
  return splat<double>(0.5) * (e + splat<double>(1) / e);
}

SIM_INLINE Doubles tanh_of(Doubles x) {
  const Doubles e = expm1_of(at_most(splat<double>(2) * magnitude(x), 60));
  return with_sign_of(e / (e + splat<double>(2)), x);
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
