// e^v from sums and products alone. Read once an instruction set, after core/simd/vector.h.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

typedef std::int64_t Words __attribute__((vector_size(SIM_BITS / 8)));

// 1/13!, 1/12!, ... 1/0!
inline constexpr double kInverseFactorials[14] = {1 / 6227020800.0,
                                                  1 / 479001600.0,
                                                  1 / 39916800.0,
                                                  1 / 3628800.0,
                                                  1 / 362880.0,
                                                  1 / 40320.0,
                                                  1 / 5040.0,
                                                  1 / 720.0,
                                                  1 / 120.0,
                                                  1 / 24.0,
                                                  1 / 6.0,
                                                  1 / 2.0,
                                                  1.0,
                                                  1.0};

// e^v = 2^k e^r with k = round(v / log 2), |r| <= log(2) / 2, and Taylor's series of 14 terms; the
// first 3.5e-18 left out. Relative error below 3e-16; v counts as -700 below and as 700 above.
SIM_INLINE Doubles exponential(Doubles v) {
  const Doubles least = splat<double>(-700), most = splat<double>(700);
  v = v > least ? v : least;
  v = v < most ? v : most;
  // Added to 1.5 2^52, a number is rounded to an integer, which stands in the lowest bits.
  const Doubles round = splat<double>(0x1.8p52);
  const Doubles sum = fma(v, splat<double>(1.4426950408889634074), round), k = sum - round;
  // log 2 in two parts, the first of 36 bits.
  Doubles r = fma(k, splat<double>(-0x1.62e42fefap-1), v);
  r = fma(k, splat<double>(-0x1.cf79abc9e3b3ap-40), r);
  Doubles series = splat<double>(kInverseFactorials[0]);
  for (int term = 1; term < 14; ++term)
    series = fma(series, r, splat<double>(kInverseFactorials[term]));
  return (Doubles)((Words)series + ((Words)sum << 52));
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
