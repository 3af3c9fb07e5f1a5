#include "fluid_forces.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "fluid_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// The kernel of a pair: q = r/h, its inverse, and u = 1 - q/2; w = u^4 (2 q + 1), w'/q = -5 u^3.
struct Kernel {
  Doubles scale;  // 1/h^2
  SIM_INLINE explicit Kernel(const FluidLaw& law)
      : scale(splat<double>(1 / (law.smoothing * law.smoothing))) {}

  struct At {
    Doubles q, inverse, u;

    SIM_INLINE Doubles w() const {
      const Doubles uu = u * u;
      return uu * uu * fma(splat<double>(2), q, splat<double>(1));
    }
    SIM_INLINE Doubles cube() const { return u * u * u; }
    // The potential of surface tension in units of A, and its slope over r in units of -A/(2 h^2).
    SIM_INLINE Doubles tie() const {
      return u * u * u * fma(splat<double>(1.125), u, splat<double>(-1));
    }
    SIM_INLINE Doubles tie_slope() const {
      return u * u * inverse * fma(splat<double>(4.5), u, splat<double>(-3));
    }
  };
  SIM_INLINE Doubles soft(Doubles rr) const { return fma(rr, scale, splat<double>(0.01)); }

  // The kernel at r^2 = rr >= 0. The summand is below the rounding of any relevant q, and keeps the
  // root from 0.
  SIM_INLINE At at(Doubles rr) const {
    const Doubles square = fma(rr, scale, splat<double>(1e-24)), r = seed(square);
    const Doubles inverse = refined(r, seed_error(square, r)), q = square * inverse;
    return {q, inverse, fma(splat<double>(-0.5), q, splat<double>(1))};
  }
};

// v if the condition holds, otherwise exactly 0, whatever v is there.
SIM_INLINE Doubles only(Mask condition, Doubles v) { return condition ? v : Doubles{}; }

SIM_INLINE Doubles gather_one(const double* of, const std::int32_t* index) {
  Doubles v;
  for (int lane = 0; lane < kDoubles; ++lane) v[lane] = of[4 * std::ptrdiff_t{index[lane]}];
  return v;
}

// Not inlined: mostly walls are planes, and loops are quicker without it.
__attribute__((noinline)) void copy_fourths(const double* of, const std::int32_t* index,
                                            double* to) {
  for (int lane = 0; lane < kDoubles; ++lane) to[lane] = of[4 * std::ptrdiff_t{index[lane]} + 3];
}

SIM_INLINE V3<double> plus(Doubles by, const V3<double>& displacement, const V3<double>& sum) {
  return {fma(by, displacement.x, sum.x), fma(by, displacement.y, sum.y),
          fma(by, displacement.z, sum.z)};
}
SIM_INLINE Doubles braked(const V3<double>& v, const V3<double>& d, Doubles weight) {
  return fma(v.z, d.z, fma(v.y, d.y, v.x * d.x)) * weight;
}
SIM_INLINE Doubles drag_factor(const FluidLaw& law) {
  return splat<double>(-law.viscosity * law.friction / (law.smoothing * law.smoothing));
}

SIM_INLINE bool any_below(Doubles v, double limit) { return any_above(-v, -limit); }

// Lanes of a block, eight or a part of them, with the walls near it.
struct Own {
  std::int32_t place[kDoubles];
  V3<double> here;
  int walls = 0;
  const double* seen[MirrorBoundary::kMost];
  bool plane[MirrorBoundary::kMost];
  Doubles gap[MirrorBoundary::kMost];
  V3<double> normal[MirrorBoundary::kMost];

  SIM_INLINE Own(const FluidBlocks& from, int b, int half) {
    for (int lane = 0; lane < kDoubles; ++lane) place[lane] = 8 * b + half + lane;
    here = gather(from.points, place);
    const unsigned near = from.near ? from.near[b] : 0;
    for (int wall = 0; near >> wall; ++wall) {
      if (!(near >> wall & 1)) continue;
      seen[walls] = from.walls[wall];
      plane[walls] = from.planes >> wall & 1;
      gap[walls] = gather_one(seen[walls] + 3, place);
      normal[walls] = gather(seen[walls], place);
      ++walls;
    }
  }

  // The gaps of the neighbours that are d away.
  SIM_INLINE Doubles gap_of(int wall, const V3<double>& d, const std::int32_t* slot) const {
    if (!plane[wall]) {
      double gaps[kDoubles];
      copy_fourths(seen[wall], slot, gaps);
      return load(gaps);
    }
    const V3<double>& n = normal[wall];
    return fma(-n.z, d.z, fma(-n.y, d.y, fma(-n.x, d.x, gap[wall])));
  }
};

// Calls image(rr, within, walls, count) for the images of a pair, r^2 apart, in one wall, in two
// that meet and in three: `product` has 4 g_i g_j of each. An image inside a wall is taken as at 0.
template <class Image>
SIM_INLINE void each_image(int walls, const Doubles* product, Doubles rr, Mask within, double limit,
                           const Image& image) {
  const auto offer = [&](Doubles at, const int* of, int count) __attribute__((always_inline)) {
    const Mask inside = within & (at < splat<double>(limit));
    image(at > Doubles{} ? at : Doubles{}, inside, of, count);
  };
  int of[3];
  for (of[0] = 0; of[0] < walls; ++of[0]) {
    const Doubles one = rr + product[of[0]];
    if (!any_below(one, limit)) continue;
    offer(one, of, 1);
    for (of[1] = of[0] + 1; of[1] < walls; ++of[1]) {
      const Doubles two = one + product[of[1]];
      if (!any_below(two, limit)) continue;
      offer(two, of, 2);
      for (of[2] = of[1] + 1; of[2] < walls; ++of[2]) {
        const Doubles three = two + product[of[2]];
        if (any_below(three, limit)) offer(three, of, 3);
      }
    }
  }
}

// 1 / (q^2 + 1/100), for weights.
SIM_INLINE Doubles soft_inverse(Doubles square) {
  const Doubles r = inverse_seed(square), e = fma(-square, r, splat<double>(1));
  return fma(r * e, e + splat<double>(1), r);
}

// n of each place: each has a lane of its own, and entries of its list beyond reach add exact
// zeros, as do walls near other lanes. With kTies also half the energy of its ties. Stores data for
// the forces: u^3/(q^2 + 1/100) of each entry, and then u^3 of each image.
template <bool kTies>
void densities(const FluidLaw& law, const FluidBlocks& from, int begin, int end, double* n) {
  const Kernel kernel(law);
  const double limit = 4 * law.smoothing * law.smoothing;
  const Doubles limits = splat<double>(limit), four = splat<double>(4);
  for (int b = begin; b < end; ++b) {
    const NeighbourBlock& block = from.blocks[b];
    for (int half = 0; half < 8; half += kDoubles) {
      const Own own(from, b, half);
      Doubles sum = splat<double>(1), ties{}, product[MirrorBoundary::kMost];
      const std::int32_t* slot = block.slots + half;
      double* weights = from.weights + from.firsts[b] + half;
      double* cubes = weights + 8 * std::ptrdiff_t{block.length};
      const auto image = [&](Doubles rr, Mask within, const int*, int)
          __attribute__((always_inline)) {
        const auto at = kernel.at(rr);
        sum += only(within, at.w());
        store(cubes, only(within, at.cube()));
        cubes += 8;
      };
      for (std::int32_t k = 0; k < block.length; ++k, slot += 8, weights += 8) {
        const V3<double> d = own.here - gather(from.points, slot);
        const Doubles rr = squared(d);
        const Mask within = (rr < limits) & (rr > Doubles{});
        const auto at = kernel.at(rr);
        sum += only(within, at.w());
        store(weights, only(within, at.cube() * soft_inverse(kernel.soft(rr))));
        if constexpr (kTies) ties += only(within, at.tie());
        if (own.walls == 0) continue;
        for (int wall = 0; wall < own.walls; ++wall)
          product[wall] = four * own.gap[wall] * own.gap_of(wall, d, slot);
        each_image(own.walls, product, rr, within, limit, image);
      }
      for (int wall = 0; wall < own.walls; ++wall)
        product[wall] = four * own.gap[wall] * own.gap[wall];
      each_image(own.walls, product, Doubles{}, Doubles{} < limits, limit, image);
      store(n + 8 * b + half, splat<double>(law.scale) * sum);
      if constexpr (kTies)
        store(from.ties + 8 * b + half, splat<double>(0.5 * law.cohesion) * ties);
    }
  }
}

// A product that underflows may have left -0, which the exact zero makes 0.
SIM_INLINE void put(Doubles factor, const V3<double>& sum, int b, int half, double* f) {
  const V3<double> all = {fma(factor, sum.x, Doubles{}), fma(factor, sum.y, Doubles{}),
                          fma(factor, sum.z, Doubles{})};
  f += 32 * std::ptrdiff_t{b} + 4 * half;
  for (int lane = 0; lane < kDoubles; ++lane, f += 4) {
    f[0] = all.x[lane];
    f[1] = all.y[lane];
    f[2] = all.z[lane];
  }
}

// f_i = 5 V scale / h^2 sum_j (e'_i + e'_j) u^3 d, where d of an image is (d + 2 sum g_j n_i): half
// of the derivative of its squared distance by x_i. With kDrag also the drag of resistance().
template <bool kTies, bool kDrag>
void forces(const FluidLaw& law, const FluidBlocks& from, int begin, int end, double* f,
            double* drag) {
  const Kernel kernel(law);
  const double hh = law.smoothing * law.smoothing, limit = 4 * hh;
  const Doubles limits = splat<double>(limit), four = splat<double>(4), two = splat<double>(2);
  const Doubles factor = splat<double>(5 * law.volume * law.scale / hh);
  const Doubles tie = splat<double>(law.cohesion / (10 * law.volume * law.scale));
  for (int b = begin; b < end; ++b) {
    const NeighbourBlock& block = from.blocks[b];
    for (int half = 0; half < 8; half += kDoubles) {
      const Own own(from, b, half);
      const Doubles pressure = gather_one(from.points + 3, own.place);
      const V3<double> speed = kDrag ? gather(from.velocities, own.place) : V3<double>{};
      V3<double> sum{}, apply_viscosity{}, d{};
      Doubles both{}, gap[MirrorBoundary::kMost], product[MirrorBoundary::kMost];
      const std::int32_t* slot = block.slots + half;
      const double* weights = from.weights + from.firsts[b] + half;
      const double* cubes = weights + 8 * std::ptrdiff_t{block.length};
      const auto image = [&](Doubles, Mask, const int* of, int count)
          __attribute__((always_inline)) {
        V3<double> displacement = d;
        for (int k = 0; k < count; ++k)
          displacement = plus(two * gap[of[k]], own.normal[of[k]], displacement);
        sum = plus(both * load(cubes), displacement, sum);
        cubes += 8;
      };
      for (std::int32_t k = 0; k < block.length; ++k, slot += 8, weights += 8) {
        Doubles other;
        d = own.here - gather(from.points, slot, other);
        both = pressure + other;
        const Doubles rr = squared(d), weight = load(weights);
        Doubles by = both * (weight * kernel.soft(rr));
        if constexpr (kDrag)
          apply_viscosity =
              plus(braked(speed - gather(from.velocities, slot), d, weight), d, apply_viscosity);
        if (!kTies && own.walls == 0) {
          sum = plus(by, d, sum);
          continue;
        }
        const Mask within = (rr < limits) & (rr > Doubles{});
        if constexpr (kTies) by += only(within, tie * kernel.at(rr).tie_slope());
        sum = plus(by, d, sum);
        for (int wall = 0; wall < own.walls; ++wall) {
          gap[wall] = own.gap_of(wall, d, slot);
          product[wall] = four * own.gap[wall] * gap[wall];
        }
        each_image(own.walls, product, rr, within, limit, image);
      }
      d = V3<double>{};
      both = two * pressure;
      for (int wall = 0; wall < own.walls; ++wall) {
        gap[wall] = own.gap[wall];
        product[wall] = four * gap[wall] * gap[wall];
      }
      each_image(own.walls, product, Doubles{}, Doubles{} < limits, limit, image);
      put(factor, sum, b, half, f);
      if constexpr (kDrag) put(drag_factor(law), apply_viscosity, b, half, drag);
    }
  }
}

// f_i = -mu friction sum_j (v_ij.d)/(r^2 + h^2/100) u^3 d
void resistance(const FluidLaw& law, const FluidBlocks& from, int begin, int end, double* f) {
  for (int b = begin; b < end; ++b) {
    const NeighbourBlock& block = from.blocks[b];
    for (int half = 0; half < 8; half += kDoubles) {
      std::int32_t place[kDoubles];
      for (int lane = 0; lane < kDoubles; ++lane) place[lane] = 8 * b + half + lane;
      const V3<double> here = gather(from.points, place), own = gather(from.velocities, place);
      V3<double> sum{};
      const std::int32_t* slot = block.slots + half;
      const double* weights = from.weights + from.firsts[b] + half;
      for (std::int32_t k = 0; k < block.length; ++k, slot += 8, weights += 8) {
        const V3<double> d = here - gather(from.points, slot);
        sum = plus(braked(own - gather(from.velocities, slot), d, load(weights)), d, sum);
      }
      put(drag_factor(law), sum, b, half, f);
    }
  }
}

template <bool kTies>
void all_forces(const FluidLaw& law, const FluidBlocks& from, int begin, int end, double* f,
                double* drag) {
  (drag ? forces<kTies, true> : forces<kTies, false>)(law, from, begin, end, f, drag);
}

template <bool kTies>
constexpr FluidKernels kOf{densities<kTies>, all_forces<kTies>, resistance};

FluidKernels kernels_of(const FluidLaw& law) { return law.cohesion > 0 ? kOf<true> : kOf<false>; }

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

FluidKernels fluid_kernels(const FluidLaw& law) { return SIM_CHOOSE(kernels_of)(law); }

}  // namespace sim
#endif
