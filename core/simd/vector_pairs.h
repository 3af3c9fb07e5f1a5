// The part of core/simd/vector.h that all instruction sets of 128 bits share.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

// sum + v^2 where the bit of the lane is set, sum elsewhere.
SIM_INLINE Doubles add_square(unsigned bits, Doubles v, Doubles sum) {
  const Doubles kept = keep(bits, v);
  return fma(kept, kept, sum);
}

// The points at points[4 index[lane]], each of four doubles.
SIM_INLINE V3<double> gather(const double* points, const std::int32_t* index) {
  const double* const a = points + 4 * std::ptrdiff_t{index[0]};
  const double* const b = points + 4 * std::ptrdiff_t{index[1]};
  return {Doubles{a[0], b[0]}, Doubles{a[1], b[1]}, Doubles{a[2], b[2]}};
}
// The same, and the fourth double of each.
SIM_INLINE V3<double> gather(const double* points, const std::int32_t* index, Doubles& fourth) {
  const auto last = [&](int lane) { return points[4 * std::ptrdiff_t{index[lane]} + 3]; };
  fourth = Doubles{last(0), last(1)};
  return gather(points, index);
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
