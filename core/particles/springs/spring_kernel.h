// Shared by the kernels of springs: the geometry of a run's springs and their forces, for a vector
// of particles.
//
// Read once an instruction set, behind core/simd/foreach_target.h.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

// k, or 0 for slack springs of one sense: slack() of the squares. A dd that is not a number keeps
// k, so that the error propagates.
template <class Real>
SIM_INLINE V<Real> taut_stiffness(SpringSense sense, V<Real> k, V<Real> rest, V<Real> dd) {
  if (sense == SpringSense::kBoth) [[likely]]
    return k;
  const V<Real> zero{}, sign = splat<Real>(static_cast<int>(sense));
  return sign * (dd - rest * rest) < zero ? zero : k;
}

// k and k r of springs, for instance those that the particles from i on own.
template <class Real>
struct Constants {
  V<Real> k, k_rest;

  SIM_INLINE Constants(V<Real> stiffness, V<Real> times_rest) : k(stiffness), k_rest(times_rest) {}
  SIM_INLINE Constants(const RunColumns& run, std::int64_t i, V<Real> dd) : Constants(run) {
    at(run, i, dd);
  }
  // The constants of a uniform run, or of another one until at() looks them up. Forces need -k.
  SIM_INLINE explicit Constants(const RunColumns& run)
      : k(-splat<Real>(run.minus_k)), k_rest(splat<Real>(run.k_rest)) {}
  // dd = |d|^2 of these springs, for those of one sense.
  SIM_INLINE void at(const RunColumns& run, std::int64_t i, V<Real> dd) {
    if (!run.ks) [[likely]]
      return;
    const V<Real> rest = load<Real>(run.rests + i);
    k = taut_stiffness<Real>(run.sense, load<Real>(run.ks + i), rest, dd);
    k_rest = k * rest;
  }
};

// d = x_a - x_b of these springs.
template <class Real>
SIM_INLINE V3<Real> difference(const RunColumns& run, const Real* const q[3], std::int64_t i) {
  return load(q, i) - load(q, i + run.stride);
}

// sum += s d
template <class Real>
SIM_INLINE void add_scaled(V<Real> s, const V3<Real>& d, V3<Real>& sum) {
  sum.x = fma(s, d.x, sum.x);
  sum.y = fma(s, d.y, sum.y);
  sum.z = fma(s, d.z, sum.z);
}

// The factor s = k rest / |d| - k of springs in the lanes whose bit is set: their force is s d. It
// is 0 in the others. From dd = |d|^2 and the seed r of 1/|d|; errors += the squared errors of the
// seeds.
SIM_INLINE Doubles spring_factors(Doubles dd, Doubles r, const Constants<double>& spring,
                                  unsigned bits, Doubles& errors) {
  const Doubles e = seed_error(dd, r);
  errors = add_square(bits, e, errors);
  return keep(bits, fma(spring.k_rest, refined(r, e), -spring.k));
}
SIM_INLINE Doubles spring_factors(const V3<double>& d, const Constants<double>& spring,
                                  unsigned bits, Doubles& errors) {
  const Doubles dd = squared(d);
  return spring_factors(dd, seed(dd), spring, bits, errors);
}

// In single precision distances below kLeastDistance are raised to it: no force at 0, no overflow.
SIM_INLINE Floats spring_factors(const V3<float>& d, const Constants<float>& spring, unsigned bits,
                                 Floats& /*errors*/) {
  constexpr double kLeastDistance = 1e-15;  // m
  const Floats least = splat<float>(kLeastDistance * kLeastDistance);
  return keep(bits, fma(spring.k_rest, inverse_sqrt(greater(squared(d), least)), -spring.k));
}

// The errors plus 0, or not a number if a sum is not finite: it may come from a lane without a
// spring whose distance overflowed.
template <class Real>
SIM_INLINE V<Real> watched(V<Real> errors, const V3<Real>& sum) {
  const V<Real> zero{};
  return fma(zero, sum.x, fma(zero, sum.y, fma(zero, sum.z, errors)));
}

// True if a seed failed, or a sum is not finite.
SIM_INLINE bool needs_care(Doubles errors, const V3<double>& sum) {
  return any_above(watched<double>(errors, sum), kSeedError);
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
