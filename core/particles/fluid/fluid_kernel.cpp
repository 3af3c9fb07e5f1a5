#include "core/particles/fluid/fluid_forces.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/fluid/fluid_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// Of a pair: q = r/h, its inverse, and u = 1 - q/2; w = u^4 (2 q + 1), w'/q = -5 u^3.
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
    // Of A and of -A/(2 h^2): the potential of surface tension, and its slope over r.
    SIM_INLINE Doubles tie() const {
      return u * u * u * fma(splat<double>(1.125), u, splat<double>(-1));
    }
    SIM_INLINE Doubles tie_slope() const {
      return u * u * inverse * fma(splat<double>(4.5), u, splat<double>(-3));
    }
  };
  // At r^2 = rr >= 0. The summand is lost in any q that matters, and keeps the root from 0.
  SIM_INLINE At at(Doubles rr) const {
    const Doubles square = fma(rr, scale, splat<double>(1e-24)), r = seed(square);
    const Doubles inverse = refined(r, seed_error(square, r)), q = square * inverse;
    return {q, inverse, fma(splat<double>(-0.5), q, splat<double>(1))};
  }
};

// v where the condition holds, exactly 0 elsewhere, whatever v is there.
SIM_INLINE Doubles only(Mask condition, Doubles v) { return condition ? v : Doubles{}; }

SIM_INLINE Doubles gather_one(const double* of, const std::int32_t* index) {
  Doubles v;
  for (int lane = 0; lane < kDoubles; ++lane) v[lane] = of[4 * std::ptrdiff_t{index[lane]}];
  return v;
}

SIM_INLINE bool any_below(Doubles v, double limit) { return any_above(-v, -limit); }

// Lanes of a block, eight or a part of them, beside the walls near it.
struct Own {
  std::int32_t place[kDoubles];
  V3<double> here;
  int walls = 0;
  const double* seen[FluidWalls::kMost];
  Doubles gap[FluidWalls::kMost];
  V3<double> normal[FluidWalls::kMost];

  SIM_INLINE Own(const FluidBlocks& from, int b, int half) {
    for (int lane = 0; lane < kDoubles; ++lane) place[lane] = 8 * b + half + lane;
    here = gather(from.points, place);
    const unsigned near = from.near ? from.near[b] : 0;
    for (int wall = 0; near >> wall; ++wall) {
      if (!(near >> wall & 1)) continue;
      seen[walls] = from.walls[wall];
      gap[walls] = gather_one(seen[walls] + 3, place);
      normal[walls] = gather(seen[walls], place);
      ++walls;
    }
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

// n of each place: each has a lane of its own, and what its list holds beyond reach adds exact
// zeros, as do walls near other lanes. With kTies also half the energy of its ties.
template <bool kTies>
void densities(const FluidLaw& law, const FluidBlocks& from, int begin, int end, double* n) {
  const Kernel kernel(law);
  const double limit = 4 * law.smoothing * law.smoothing;
  const Doubles limits = splat<double>(limit), four = splat<double>(4);
  for (int b = begin; b < end; ++b) {
    const NeighbourBlock& block = from.blocks[b];
    for (int half = 0; half < 8; half += kDoubles) {
      const Own own(from, b, half);
      Doubles sum = splat<double>(1), ties{}, product[FluidWalls::kMost];
      const auto image = [&](Doubles rr, Mask within, const int*, int)
          __attribute__((always_inline)) {
        sum += only(within, kernel.at(rr).w());
      };
      const std::int32_t* slot = block.slots + half;
      for (std::int32_t k = 0; k < block.length; ++k, slot += 8) {
        const Doubles rr = squared(own.here - gather(from.points, slot));
        const Mask within = (rr < limits) & (rr > Doubles{});
        const auto at = kernel.at(rr);
        sum += only(within, at.w());
        if constexpr (kTies) ties += only(within, at.tie());
        if (own.walls == 0) continue;
        for (int wall = 0; wall < own.walls; ++wall)
          product[wall] = four * own.gap[wall] * gather_one(own.seen[wall] + 3, slot);
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
// of how the square of its distance changes with x_i. With kViscous the weights of viscosity are
// kept for resistance().
template <bool kViscous, bool kTies>
void forces(const FluidLaw& law, const FluidBlocks& from, int begin, int end, double* f) {
  const Kernel kernel(law);
  const double hh = law.smoothing * law.smoothing, limit = 4 * hh;
  const Doubles limits = splat<double>(limit), four = splat<double>(4), two = splat<double>(2);
  const Doubles factor = splat<double>(5 * law.volume * law.scale / hh);
  const Doubles tie = splat<double>(law.cohesion / (10 * law.volume * law.scale));
  const Doubles least = splat<double>(0.01 * hh);
  for (int b = begin; b < end; ++b) {
    const NeighbourBlock& block = from.blocks[b];
    for (int half = 0; half < 8; half += kDoubles) {
      const Own own(from, b, half);
      const Doubles pressure = gather_one(from.points + 3, own.place);
      V3<double> sum{}, d{};
      Doubles both{}, gap[FluidWalls::kMost], product[FluidWalls::kMost];
      const auto add = [&](Doubles by, const V3<double>& way) __attribute__((always_inline)) {
        sum = {fma(by, way.x, sum.x), fma(by, way.y, sum.y), fma(by, way.z, sum.z)};
      };
      const auto image = [&](Doubles rr, Mask within, const int* of, int count)
          __attribute__((always_inline)) {
        V3<double> way = d;
        for (int k = 0; k < count; ++k) {
          const Doubles twice = two * gap[of[k]];
          const V3<double>& normal = own.normal[of[k]];
          way = {fma(twice, normal.x, way.x), fma(twice, normal.y, way.y),
                 fma(twice, normal.z, way.z)};
        }
        add(only(within, both * kernel.at(rr).cube()), way);
      };
      const std::int32_t* slot = block.slots + half;
      double* weights = kViscous ? from.weights + from.firsts[b] + half : nullptr;
      for (std::int32_t k = 0; k < block.length; ++k, slot += 8) {
        Doubles other;
        d = own.here - gather(from.points, slot, other);
        both = pressure + other;
        const Doubles rr = squared(d);
        const Mask within = (rr < limits) & (rr > Doubles{});
        const auto at = kernel.at(rr);
        const Doubles cube = only(within, at.cube());
        if constexpr (kTies)
          add(fma(both, cube, only(within, tie * at.tie_slope())), d);
        else
          add(both * cube, d);
        if constexpr (kViscous) {
          store(weights, cube / (rr + least));
          weights += 8;
        }
        if (own.walls == 0) continue;
        for (int wall = 0; wall < own.walls; ++wall) {
          gap[wall] = gather_one(own.seen[wall] + 3, slot);
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
    }
  }
}

// f_i = -mu friction sum_j (v_ij.d)/(r^2 + h^2/100) u^3 d
void resistance(const FluidLaw& law, const FluidBlocks& from, int begin, int end, double* f) {
  const Doubles factor = splat<double>(-law.viscosity * law.friction);
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
        const V3<double> v = own - gather(from.velocities, slot);
        const Doubles by = fma(v.z, d.z, fma(v.y, d.y, v.x * d.x)) * load(weights);
        sum = {fma(by, d.x, sum.x), fma(by, d.y, sum.y), fma(by, d.z, sum.z)};
      }
      put(factor, sum, b, half, f);
    }
  }
}

template <bool kViscous, bool kTies>
constexpr FluidKernels kOf{densities<kTies>, forces<kViscous, kTies>, resistance};

FluidKernels kernels_of(const FluidLaw& law) {
  if (law.cohesion > 0) return law.viscosity > 0 ? kOf<true, true> : kOf<false, true>;
  return law.viscosity > 0 ? kOf<true, false> : kOf<false, false>;
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

FluidKernels fluid_kernels(const FluidLaw& law) { return SIM_CHOOSE(kernels_of)(law); }

}  // namespace sim
#endif
