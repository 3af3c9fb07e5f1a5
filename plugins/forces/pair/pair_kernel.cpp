#include "pair_forces.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "pair_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "exponential.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

struct Terms {
  Doubles u, g, dg;  // as in PairTerms
};

// Each law is written once, from rr = r^2 > 0; unused results cost nothing.

// With kSlope the slope is shifted, for which r itself is needed.
template <bool kSlope>
struct LennardJones {
  static constexpr bool kSingular = true;
  Doubles square, energy, first, second, shift, slope, cutoff;
  SIM_INLINE explicit LennardJones(const PairLaw& law)
      : square(splat<double>(law.length * law.length)),
        energy(splat<double>(4 * law.strength)),
        first(splat<double>(24 * law.strength / (law.length * law.length))),
        second(first / square),
        shift(splat<double>(law.energy_shift)),
        slope(splat<double>(law.slope_shift)),
        cutoff(splat<double>(law.cutoff)) {}

  // With p = (sigma / r)^2 and s = p^3: U = 4 eps (s^2 - s), g = 24 eps / sigma^2 p s (2 s - 1),
  // dg/d(r^2) = -24 eps / sigma^4 p^2 s (14 s - 4).
  SIM_INLINE Terms at(Doubles rr) const {
    const Doubles p = square / rr, s = p * p * p, ps = p * s;
    Terms t;
    t.u = fma(energy * s, s - splat<double>(1), -shift);
    t.g = ps * fma(splat<double>(2) * first, s, -first);
    t.dg = p * ps * (second * fma(splat<double>(-14), s, splat<double>(4)));
    if constexpr (kSlope) {
      const Doubles inverse = splat<double>(1) / rr, one = square_root(inverse);  // 1 / r
      t.u = fma(-slope, rr * one - cutoff, t.u);
      t.g = fma(slope, one, t.g);
      t.dg = fma(splat<double>(-0.5) * slope, one * inverse, t.dg);
    }
    return t;
  }
};

struct Soft {
  static constexpr bool kSingular = false;
  Doubles strength, length;
  SIM_INLINE explicit Soft(const PairLaw& law)
      : strength(splat<double>(law.strength)), length(splat<double>(law.length)) {}

  // U = k/2 (R - r)^2, g = k (R / r - 1), dg/d(r^2) = -k R / (2 r^3).
  SIM_INLINE Terms at(Doubles rr) const {
    const Doubles r = square_root(rr), gap = length - r, inverse = splat<double>(1) / r;
    return {splat<double>(0.5) * strength * gap * gap, strength * gap * inverse,
            splat<double>(-0.5) * strength * length * inverse * inverse * inverse};
  }
};

struct Morse {
  static constexpr bool kSingular = false;
  Doubles strength, length, rate, shift, slope, cutoff;
  SIM_INLINE explicit Morse(const PairLaw& law)
      : strength(splat<double>(law.strength)),
        length(splat<double>(law.length)),
        rate(splat<double>(law.rate)),
        shift(splat<double>(law.energy_shift)),
        slope(splat<double>(law.slope_shift)),
        cutoff(splat<double>(law.cutoff)) {}

  // U' = -2 a D (e^2 - e), U'' = 2 a^2 D (2 e^2 - e); g = -U' / r,
  // dg/d(r^2) = (U' / r - U'') / (2 r^2).
  SIM_INLINE Terms at(Doubles rr) const {
    const Doubles r = square_root(rr), inverse = splat<double>(1) / r;
    const Doubles e = exponential(rate * (length - r));
    const Doubles steep = splat<double>(2) * rate * strength * e;  // 2 a D e
    const Doubles first = fma(-steep, e - splat<double>(1), -slope);
    const Doubles second = steep * rate * fma(splat<double>(2), e, splat<double>(-1));
    return {fma(strength * e, e - splat<double>(2), fma(-slope, r - cutoff, -shift)),
            -first * inverse, splat<double>(0.5) * (first * inverse - second) * inverse * inverse};
  }
};

// v if the condition holds, otherwise exactly 0, whatever v is there.
SIM_INLINE Doubles where(Mask condition, Doubles v) { return condition ? v : Doubles{}; }

// The forces on the particles of blocks [begin, end), four doubles a place, and half the energies
// of their pairs. Each particle has a lane of its own, and entries of its list beyond the cutoff
// add exact zeros: the sums depend neither on the other lanes nor on when the lists were made. Two
// particles at one place have an energy, unlike the entries that fill up a list.
template <class Law, bool kEnergies>
void add_pairs(const PairLaw& parameters, const NeighbourBlock* blocks, const double* points,
               int begin, int end, double* forces, double* energies) {
  const Law law(parameters);
  const Doubles limit = splat<double>(parameters.cutoff * parameters.cutoff);
  for (int b = begin; b < end; ++b) {
    const NeighbourBlock& block = blocks[b];
    double sums[3][8];
    for (int half = 0; half < 8; half += kDoubles) {
      std::int32_t own[kDoubles], length = 0;
      Doubles counts{};
      for (int lane = 0; lane < kDoubles; ++lane) {
        const std::int32_t count = block.count[half + lane];
        own[lane] = 8 * b + half + lane;
        counts[lane] = count;
        length = length < count ? count : length;
      }
      const V3<double> here = gather(points, own);
      V3<double> sum{};
      Doubles energy{};
      const std::int32_t* slot = block.slots + half;
      for (std::int32_t k = 0; k < length; ++k, slot += 8) {
        const V3<double> d = here - gather(points, slot);
        const Doubles rr = squared(d);
        const Terms t = law.at(rr);
        const Mask within = rr < limit, apart = within & (rr > Doubles{});
        const Doubles g = where(apart, t.g);
        sum = {fma(g, d.x, sum.x), fma(g, d.y, sum.y), fma(g, d.z, sum.z)};
        if constexpr (kEnergies)
          energy += where(Law::kSingular ? apart : within & (splat<double>(k) < counts), t.u);
      }
      // A product that underflows may have left -0, which the next exact zero makes 0.
      store(sums[0] + half, sum.x + Doubles{});
      store(sums[1] + half, sum.y + Doubles{});
      store(sums[2] + half, sum.z + Doubles{});
      if constexpr (kEnergies)
        store(energies + 8 * std::ptrdiff_t{b} + half, splat<double>(0.5) * energy);
    }
    if (!forces) continue;
    double* force = forces + 32 * std::ptrdiff_t{b};
    for (int lane = 0; lane < 8; ++lane, force += 4)
      for (int axis = 0; axis < 3; ++axis) force[axis] = sums[axis][lane];
  }
}

template <class Law>
void pair_forces(const PairLaw& law, const NeighbourBlock* blocks, const double* points, int begin,
                 int end, double* forces, double* energies) {
  if (energies)
    add_pairs<Law, true>(law, blocks, points, begin, end, forces, energies);
  else
    add_pairs<Law, false>(law, blocks, points, begin, end, forces, nullptr);
}

// The terms at eight squared distances.
template <class Law>
void pair_terms(const PairLaw& parameters, const double* squares, PairTerms& terms) {
  const Law law(parameters);
  const Doubles limit = splat<double>(parameters.cutoff * parameters.cutoff), zero{};
  for (int half = 0; half < 8; half += kDoubles) {
    const Doubles rr = load(squares + half);
    const Terms t = law.at(rr);
    const auto within = rr < limit, apart = within & (rr > zero);
    store(terms.u + half, where(Law::kSingular ? apart : within, t.u));
    store(terms.g + half, where(apart, t.g));
    store(terms.dg + half, where(apart, t.dg));
  }
}

template <class Law>
constexpr PairKernels kOf{pair_forces<Law>, pair_terms<Law>};

PairKernels kernels_of(const PairLaw& law) {
  switch (law.kind) {
    case PairLaw::Kind::kSoft:
      return kOf<Soft>;
    case PairLaw::Kind::kMorse:
      return kOf<Morse>;
    default:
      return law.slope_shift == 0 ? kOf<LennardJones<false>> : kOf<LennardJones<true>>;
  }
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

PairKernels pair_kernels(const PairLaw& law) { return SIM_CHOOSE(kernels_of)(law); }

}  // namespace sim
#endif
