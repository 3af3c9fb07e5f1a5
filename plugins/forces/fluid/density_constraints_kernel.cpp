#include "density_constraints.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "density_constraints_kernel.cpp"
#include "core/simd/foreach_target.h"
#include "core/simd/narrow.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// Gathers the vectors of consecutive places, from `first` on.
SIM_INLINE V3<double> gather_from(const double* of, int first) {
  std::int32_t place[kDoubles];
  for (int lane = 0; lane < kDoubles; ++lane) place[lane] = first + lane;
  return gather(of, place);
}

// n_i = scale sum of w(q), w(q) = u^4 (2 q + 1), u = 1 - q/2; dn/dx = -5 scale/h^2 u^3 d.
void slopes(const FluidLaw& law, const NeighbourBlock& block, const double* points, int number,
            double* n, float* out, float* weights) {
  const double hh = law.smoothing * law.smoothing;
  const Doubles limits = splat<double>(4 * hh), scale = splat<double>(1 / hh);
  const Doubles factor = splat<double>(-5 * law.scale / hh);
  // Friction is -mu K u^3/(r^2 + h^2/100) (v.d) d: with s = factor u^3 d that over factor^2 u^6.
  const Doubles friction =
      splat<double>(law.viscosity * law.friction * hh * hh / (25 * law.scale * law.scale));
  const Doubles least = splat<double>(0.01 * hh), shallow = splat<double>(1e-9);
  for (int half = 0; half < 8; half += kDoubles) {
    const V3<double> here = gather_from(points, 8 * number + half);
    Doubles sum = splat<double>(1);
    const std::int32_t* slot = block.slots + half;
    float* slope = out + half;
    for (std::int32_t k = 0; k < block.length; ++k, slot += 8, slope += 24) {
      const V3<double> d = here - gather(points, slot);
      const Doubles rr = squared(d);
      const Mask within = (rr < limits) & (rr > Doubles{});
      // The summand is below the rounding of any relevant q, and keeps the root from 0.
      const Doubles square = fma(rr, scale, splat<double>(1e-24)), r = seed(square);
      const Doubles q = square * refined(r, seed_error(square, r));
      const Doubles u = fma(splat<double>(-0.5), q, splat<double>(1)), cube = u * u * u;
      const Doubles w = cube * u * fma(splat<double>(2), q, splat<double>(1));
      sum += within ? w : Doubles{};
      const Doubles by = within ? factor * cube : Doubles{};
      store_narrow(slope, by * d.x);
      store_narrow(slope + 8, by * d.y);
      store_narrow(slope + 16, by * d.z);
      if (weights) {
        const Doubles deep = cube > shallow ? cube : shallow;  // a float can hold it
        store_narrow(weights + 8 * k + half, friction / (deep * (rr + least)));
      }
    }
    store(n + half, splat<double>(law.scale) * sum);
  }
}

SIM_INLINE Doubles gather_one(const double* of, const std::int32_t* index) {
  Doubles v;
  for (int lane = 0; lane < kDoubles; ++lane) v[lane] = of[index[lane]];
  return v;
}

SIM_INLINE V3<double> load_slope(const float* p) {
  return {load_narrow(p), load_narrow(p + 8), load_narrow(p + 16)};
}

SIM_INLINE V3<double> add(Doubles by, const V3<double>& a, const V3<double>& sum) {
  return {fma(by, a.x, sum.x), fma(by, a.y, sum.y), fma(by, a.z, sum.z)};
}

SIM_INLINE Doubles dot(const V3<double>& a, const V3<double>& b, Doubles sum) {
  return fma(a.z, b.z, fma(a.y, b.y, fma(a.x, b.x, sum)));
}

SIM_INLINE void put(const V3<double>& sum, double* f) {
  for (int lane = 0; lane < kDoubles; ++lane, f += 4) {
    f[0] = sum.x[lane];
    f[1] = sum.y[lane];
    f[2] = sum.z[lane];
  }
}

// (J' p)_i = sum of (p_i + p_j) s, and (p_i + p_j) a of images.
void pressure_forces(const DensityConstraintRow* rows, const double* p, int begin, int end,
                     double* out) {
  for (int b = begin; b < end; ++b) {
    const DensityConstraintRow& row = rows[b];
    for (int half = 0; half < 8; half += kDoubles) {
      const Doubles own = load(p + 8 * b + half);
      V3<double> sum{};
      for (int k = 0; k < row.length; ++k)
        sum = add(own + gather_one(p, row.slots + 8 * k + half),
                  load_slope(row.slopes + 24 * k + half), sum);
      for (int k = 0; k < row.image_length; ++k)
        sum = add(own + gather_one(p, row.image_slots + 8 * k + half),
                  load_slope(row.images + 48 * k + half), sum);
      put(sum, out + 32 * std::ptrdiff_t{b} + 4 * half);
    }
  }
}

void rates(const DensityConstraintRow* rows, const double* w, int begin, int end, double* out) {
  for (int b = begin; b < end; ++b) {
    const DensityConstraintRow& row = rows[b];
    for (int half = 0; half < 8; half += kDoubles) {
      const V3<double> own = gather_from(w, 8 * b + half);
      Doubles sum{};
      for (int k = 0; k < row.length; ++k)
        sum = dot(load_slope(row.slopes + 24 * k + half), own - gather(w, row.slots + 8 * k + half),
                  sum);
      for (int k = 0; k < row.image_length; ++k) {
        const float* const images = row.images + 48 * k + half;
        sum = dot(load_slope(images), own, sum);
        sum = dot(load_slope(images + 24), gather(w, row.image_slots + 8 * k + half), sum);
      }
      store(out + 8 * b + half, sum);
    }
  }
}

void viscous_forces(const DensityConstraintRow* rows, const double* w, int begin, int end,
                    double* out) {
  for (int b = begin; b < end; ++b) {
    const DensityConstraintRow& row = rows[b];
    for (int half = 0; half < 8; half += kDoubles) {
      const V3<double> own = gather_from(w, 8 * b + half);
      V3<double> sum{};
      for (int k = 0; k < row.length; ++k) {
        const V3<double> s = load_slope(row.slopes + 24 * k + half);
        const Doubles by = dot(s, own - gather(w, row.slots + 8 * k + half), Doubles{});
        sum = add(by * load_narrow(row.weights + 8 * k + half), s, sum);
      }
      put(sum, out + 32 * std::ptrdiff_t{b} + 4 * half);
    }
  }
}

constexpr DensityConstraintKernels kRows{slopes, pressure_forces, rates, viscous_forces};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

DensityConstraintKernels density_constraint_kernels() { return SIM_CHOOSE(kRows); }

}  // namespace sim
#endif
