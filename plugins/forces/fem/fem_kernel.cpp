#include <algorithm>
#include <type_traits>

#include "core/math/elementary.h"
#include "fem_forces.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "fem_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

constexpr int kSideBySide = 8;  // cells of a block

// A matrix by rows.
struct Rows {
  V3<double> row[3];
};

SIM_INLINE V3<double> crossed(const V3<double>& a, const V3<double>& b) {
  return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}
SIM_INLINE Doubles dotted(const V3<double>& a, const V3<double>& b) {
  return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}
// s a, and s a + b.
SIM_INLINE V3<double> times(Doubles s, const V3<double>& a) { return {s * a.x, s * a.y, s * a.z}; }
SIM_INLINE V3<double> times_plus(Doubles s, const V3<double>& a, const V3<double>& b) {
  return {fma(s, a.x, b.x), fma(s, a.y, b.y), fma(s, a.z, b.z)};
}

SIM_INLINE Rows cofactor_rows(const Rows& F) {
  return {{crossed(F.row[1], F.row[2]), crossed(F.row[2], F.row[0]), crossed(F.row[0], F.row[1])}};
}

// The six entries of C = F^T F, the sum of the r r^T of the rows r.
struct Symmetric {
  Doubles xx, yy, zz, xy, xz, yz;
};
SIM_INLINE Symmetric gram(const Rows& F) {
  const V3<double>&a = F.row[0], &b = F.row[1], &c = F.row[2];
  const auto sum = [](Doubles a1, Doubles a2, Doubles b1, Doubles b2, Doubles c1, Doubles c2)
      __attribute__((always_inline)) {
    return fma(c1, c2, fma(b1, b2, a1 * a2));
  };
  return {sum(a.x, a.x, b.x, b.x, c.x, c.x), sum(a.y, a.y, b.y, b.y, c.y, c.y),
          sum(a.z, a.z, b.z, b.z, c.z, c.z), sum(a.x, a.y, b.x, b.y, c.x, c.y),
          sum(a.x, a.z, b.x, b.z, c.x, c.z), sum(a.y, a.z, b.y, b.z, c.y, c.z)};
}
// r S of a row r.
SIM_INLINE V3<double> product(const V3<double>& r, const Symmetric& s) {
  return {fma(r.z, s.xz, fma(r.y, s.xy, r.x * s.xx)), fma(r.z, s.yz, fma(r.y, s.yy, r.x * s.xy)),
          fma(r.z, s.zz, fma(r.y, s.yz, r.x * s.xz))};
}

// P = mu (1 - 1/(I + 1)) F + (lambda (J - 1) - 3/4 mu) cof F.
SIM_INLINE Rows neo_hookean(const ConstitutiveLaw& law, const Rows& F) {
  const Doubles one = splat<double>(1), mu = splat<double>(law.mu);
  const Rows cofactors = cofactor_rows(F);
  const Doubles J = dotted(F.row[0], cofactors.row[0]);
  const Doubles I =
      dotted(F.row[0], F.row[0]) + dotted(F.row[1], F.row[1]) + dotted(F.row[2], F.row[2]);
  const Doubles by_F = mu - mu / (I + one);
  const Doubles by_J = fma(splat<double>(law.lambda), J - one, splat<double>(-0.75 * law.mu));
  Rows P;
  for (int i = 0; i < 3; ++i) P.row[i] = times_plus(by_F, F.row[i], times(by_J, cofactors.row[i]));
  return P;
}

// P = F S, S = 2 mu E + lambda tr(E) 1.
SIM_INLINE Rows st_venant_kirchhoff(const ConstitutiveLaw& law, const Rows& F) {
  const Doubles one = splat<double>(1), mu = splat<double>(law.mu);
  Symmetric s = gram(F);
  s.xx -= one;
  s.yy -= one;
  s.zz -= one;
  const Doubles all = splat<double>(0.5 * law.lambda) * (s.xx + s.yy + s.zz);
  s = {fma(mu, s.xx, all), fma(mu, s.yy, all), fma(mu, s.zz, all), mu * s.xy, mu * s.xz, mu * s.yz};
  return {{product(F.row[0], s), product(F.row[1], s), product(F.row[2], s)}};
}

// The rotation R of F = R S is dL/dF of L = tr S,
//   R = ((L^2 + I) F + 2 L cof F - 2 F C) / (L^3 - I L - 2 J),  I = tr C, J = det F,
// and L is the largest root of
//   p(L) = L^4 - 2 I L^2 - 8 J L + 2 |C|^2 - I^2,
// whose roots are all real (Lin, Chitalu & Komura (2022), Isotropic ARAP energy using Cauchy-Green
// invariants).
struct Polar {
  Doubles I, J, rest, L;  // rest: of p / 4
  Mask moves;
};

SIM_INLINE Polar start_of_polar(const Rows& F) {
  const Symmetric C = gram(F);
  Polar polar;
  polar.I = C.xx + C.yy + C.zz;
  polar.J = dotted(F.row[0], crossed(F.row[1], F.row[2]));
  const Doubles diagonal = fma(C.zz, C.zz, fma(C.yy, C.yy, C.xx * C.xx));
  const Doubles off = fma(C.yz, C.yz, fma(C.xz, C.xz, C.xy * C.xy));
  const Doubles half = splat<double>(0.5) * polar.I;
  polar.rest = fma(splat<double>(0.5), diagonal, off - half * half);
  polar.L = square_root(splat<double>(3) * polar.I);
  polar.moves = polar.L > Doubles{};
  return polar;
}

// A step of Chebyshev's method,
//   L -= n (1 + b),  n = p / p',  b = n p'' / (2 p').
// It falls from sqrt(3 I), which is not below L, and leaves at most 2 b^2 n of the error: two steps
// are enough unless a cell is strained by a fifth, and 40 unless two stretches of an inverted cell
// nearly cancel. A lane that has come so far stays: no cell depends on its neighbours in a vector.
SIM_INLINE void approach(Polar& polar) {
  const Doubles zero{}, I = polar.I, L = polar.L, two_J = polar.J + polar.J;
  const Doubles half_I = splat<double>(0.5) * I, q = L * L,
                slope = fma(q - I, L, -two_J);  // p' / 4
  const Doubles inverse = splat<double>(1) / slope;
  const Doubles value =
      fma(fma(fma(splat<double>(0.25), q, -half_I), L, -two_J), L, polar.rest);  // p / 4
  const Doubles n = value * inverse, b = fma(splat<double>(1.5), q, -half_I) * inverse * n;
  polar.moves &= slope > zero;
  polar.L -= polar.moves ? fma(n, b, n) : zero;
  polar.moves &= b * b * n > splat<double>(0x1p-54) * L;
}
constexpr int kRootSteps = 40;

// by_R R + by_F F. 1 stands for R where it jumps, because two stretches of an inverted cell cancel.
SIM_INLINE Rows combined(Doubles by_R, const Polar& polar, Doubles by_F, const Rows& F) {
  const Doubles zero{}, two = splat<double>(2), I = polar.I, L = polar.L;
  const Rows cofactors = cofactor_rows(F);
  const Symmetric C = gram(F);
  const Doubles below = fma(fma(L, L, -I), L, -(two * polar.J));
  const auto turns = below > splat<double>(1e-12) * I * L;
  const Doubles scale = turns ? by_R / below : zero, by_one = turns ? zero : by_R;
  const Doubles by_J = two * scale * L, by_C = -(two * scale);
  by_F = fma(scale, fma(L, L, I), by_F);
  Rows sum;
  for (int i = 0; i < 3; ++i)
    sum.row[i] = times_plus(by_F, F.row[i],
                            times_plus(by_J, cofactors.row[i], times(by_C, product(F.row[i], C))));
  sum.row[0].x += by_one;
  sum.row[1].y += by_one;
  sum.row[2].z += by_one;
  return sum;
}

// P = 2 mu (F - R) + lambda (R:F - 3) R, R:F = L.
SIM_INLINE Rows corotated(const ConstitutiveLaw& law, const Rows& F, const Polar& polar) {
  const Doubles mu = splat<double>(2 * law.mu), stretch = polar.L - splat<double>(3);
  return combined(fma(splat<double>(law.lambda), stretch, -mu), polar, mu, F);
}

// f_a = -sum over the points of w P grad N_a, and f_0 = -sum of the others, of kSide vectors of
// cells that hide each other's divisions.
template <int kNodes, ConstitutiveLaw::Model kModel, int kSide>
void forces_of_vectors(const ConstitutiveLaw& law, const FemCells& cells, double* forces,
                                  std::ptrdiff_t block, int lane) {
  using Model = ConstitutiveLaw::Model;
  constexpr int points = kNodes == 4 ? 1 : 4, columns = 3 * (kNodes - 1) + 1;
  constexpr bool turns = kModel == Model::kCorotated;
  const double* const rests = cells.rest + block * points * columns * kSideBySide + lane;
  const std::int32_t* const ids = cells.ids + block * kNodes * kSideBySide + lane;
  double* const out = forces + block * kNodes * 3 * kSideBySide + lane;
  // From the first vector to the k-th, in a table of so many rows.
  const auto to_vector = [](int k, int rows) __attribute__((always_inline)) {
    return k * kDoubles / kSideBySide * rows * kSideBySide + k * kDoubles % kSideBySide;
  };
  V3<double> d[kSide][kNodes - 1], f[kSide][kNodes - 1];
  for (int point = 0; point < points; ++point) {
    const auto rest = [&](int k, int column) __attribute__((always_inline)) {
      return load(rests + to_vector(k, points * columns) +
                  (point * columns + column) * kSideBySide);
    };
    const auto gradient = [&](int k, int a) __attribute__((always_inline)) {
      return V3<double>{rest(k, 3 * a + 1), rest(k, 3 * a + 2), rest(k, 3 * a + 3)};
    };
    Rows F[kSide];
    Polar polar[kSide];
#pragma GCC unroll 2
    for (int k = 0; k < kSide; ++k) {
      if (point == 0) {
        const std::int32_t* const own = ids + to_vector(k, kNodes);
        const V3<double> origin = gather(cells.points, own);
        for (int a = 0; a < kNodes - 1; ++a) {
          d[k][a] = gather(cells.points, own + (a + 1) * kSideBySide) - origin;
          f[k][a] = V3<double>{};
        }
      }
      F[k] = Rows{};
      for (int a = 0; a < kNodes - 1; ++a) {
        const V3<double> g = gradient(k, a);
        F[k].row[0] = times_plus(d[k][a].x, g, F[k].row[0]);
        F[k].row[1] = times_plus(d[k][a].y, g, F[k].row[1]);
        F[k].row[2] = times_plus(d[k][a].z, g, F[k].row[2]);
      }
      if constexpr (turns) polar[k] = start_of_polar(F[k]);
    }
    if constexpr (turns) {
      for (int i = 0; i < 2; ++i)
#pragma GCC unroll 2
        for (int k = 0; k < kSide; ++k) approach(polar[k]);
      for (int k = 0; k < kSide; ++k)
        for (int i = 2; i < kRootSteps && bits_of(polar[k].moves) != 0; ++i) approach(polar[k]);
    }
#pragma GCC unroll 2
    for (int k = 0; k < kSide; ++k) {
      Rows P = kModel == Model::kStVk        ? st_venant_kirchhoff(law, F[k])
               : kModel == Model::kCorotated ? corotated(law, F[k], polar[k])
                                             : neo_hookean(law, F[k]);
      const Doubles w = rest(k, 0);
      for (int i = 0; i < 3; ++i) P.row[i] = times(w, P.row[i]);
      for (int a = 0; a < kNodes - 1; ++a) {
        const V3<double> g = gradient(k, a);
        f[k][a].x -= dotted(P.row[0], g);
        f[k][a].y -= dotted(P.row[1], g);
        f[k][a].z -= dotted(P.row[2], g);
      }
      if (point < points - 1) continue;
      double* const own = out + to_vector(k, 3 * kNodes);
      V3<double> sum{};
      for (int a = 0; a < kNodes - 1; ++a) {
        double* const to = own + (a + 1) * 3 * kSideBySide;
        store(to, f[k][a].x);
        store(to + kSideBySide, f[k][a].y);
        store(to + 2 * kSideBySide, f[k][a].z);
        sum = sum - f[k][a];
      }
      store(own, sum.x);
      store(own + kSideBySide, sum.y);
      store(own + 2 * kSideBySide, sum.z);
    }
  }
}

template <int kNodes, ConstitutiveLaw::Model kModel>
void forces_of(const ConstitutiveLaw& law, const FemCells& cells, double* forces, int begin,
               int end) {
  constexpr int side = kModel == ConstitutiveLaw::Model::kCorotated ? 2 : 1;
  if constexpr (side * kDoubles > kSideBySide) {
    std::ptrdiff_t block = begin;
    for (; block + side <= end; block += side)
      forces_of_vectors<kNodes, kModel, side>(law, cells, forces, block, 0);
    if (block < end) forces_of_vectors<kNodes, kModel, 1>(law, cells, forces, block, 0);
  } else {
    for (std::ptrdiff_t block = begin; block < end; ++block)
      for (int lane = 0; lane < kSideBySide; lane += side * kDoubles)
        forces_of_vectors<kNodes, kModel, side>(law, cells, forces, block, lane);
  }
}

SIM_INLINE Doubles squared(const Rows& m) {
  return dotted(m.row[0], m.row[0]) + dotted(m.row[1], m.row[1]) + dotted(m.row[2], m.row[2]);
}

// The energies a volume of constitutive_law.h.
template <ConstitutiveLaw::Model kModel>
SIM_INLINE Doubles energy_density(const ConstitutiveLaw& law, const Rows& F) {
  using Model = ConstitutiveLaw::Model;
  const Doubles mu = splat<double>(law.mu), half_lambda = splat<double>(0.5 * law.lambda);
  const Doubles one = splat<double>(1), half = splat<double>(0.5);
  if constexpr (kModel == Model::kStVk) {
    const Symmetric C = gram(F);
    const Doubles xx = half * (C.xx - one), yy = half * (C.yy - one), zz = half * (C.zz - one);
    const Doubles trace = xx + yy + zz, off = fma(C.yz, C.yz, fma(C.xz, C.xz, C.xy * C.xy));
    return mu * fma(half, off, fma(zz, zz, fma(yy, yy, xx * xx))) + half_lambda * trace * trace;
  } else if constexpr (kModel == Model::kCorotated) {
    Polar polar = start_of_polar(F);
    for (int i = 0; i < kRootSteps && bits_of(polar.moves) != 0; ++i) approach(polar);
    const Doubles stretch = polar.L - splat<double>(3);
    return mu * squared(combined(-one, polar, one, F)) + half_lambda * stretch * stretch;
  } else {
    const Doubles by_volume = dotted(F.row[0], crossed(F.row[1], F.row[2])) - one;
    const Doubles I = squared(F), quarter = splat<double>(0.25) * (I + one);
    Doubles log = quarter;
    for (int lane = 0; lane < kDoubles; ++lane) log[lane] = logarithm(quarter[lane]);
    return half * mu * ((I - splat<double>(3)) - log) - splat<double>(0.75) * mu * by_volume +
           half_lambda * by_volume * by_volume;
  }
}

// The sum over the cells of a list of w psi(F) at their points, in the order of the list.
template <int kNodes, ConstitutiveLaw::Model kModel>
double energy_of(const ConstitutiveLaw& law, const FemCells& cells, const int* list, int count) {
  constexpr int points = kNodes == 4 ? 1 : 4, columns = 3 * (kNodes - 1) + 1;
  double sum = 0;
  for (int first = 0; first < count; first += kDoubles) {
    // Lanes behind the last cell repeat it.
    std::ptrdiff_t block[kDoubles], place[kDoubles];
    for (int lane = 0; lane < kDoubles; ++lane) {
      const int cell = list[std::min(first + lane, count - 1)];
      block[lane] = cell / kSideBySide;
      place[lane] = cell % kSideBySide;
    }
    const auto node = [&](int a) __attribute__((always_inline)) {
      std::int32_t ids[kDoubles];
      for (int lane = 0; lane < kDoubles; ++lane)
        ids[lane] = cells.ids[(block[lane] * kNodes + a) * kSideBySide + place[lane]];
      return gather(cells.points, ids);
    };
    const V3<double> origin = node(0);
    V3<double> d[kNodes - 1];
    for (int a = 0; a < kNodes - 1; ++a) d[a] = node(a + 1) - origin;
    Doubles energy{};
    for (int point = 0; point < points; ++point) {
      const auto rest = [&](int column) __attribute__((always_inline)) {
        Doubles v{};
        for (int lane = 0; lane < kDoubles; ++lane)
          v[lane] = cells.rest[((block[lane] * points + point) * columns + column) * kSideBySide +
                               place[lane]];
        return v;
      };
      Rows F{};
      for (int a = 0; a < kNodes - 1; ++a) {
        const V3<double> g{rest(3 * a + 1), rest(3 * a + 2), rest(3 * a + 3)};
        F.row[0] = times_plus(d[a].x, g, F.row[0]);
        F.row[1] = times_plus(d[a].y, g, F.row[1]);
        F.row[2] = times_plus(d[a].z, g, F.row[2]);
      }
      energy += rest(0) * energy_density<kModel>(law, F);
    }
    for (int lane = 0; lane < std::min(kDoubles, count - first); ++lane) sum += energy[lane];
  }
  return sum;
}

// Calls `of` with the number of nodes and the model as constants.
template <class Of>
SIM_INLINE auto chosen(const ConstitutiveLaw& law, int nodes, const Of& of) {
  using Model = ConstitutiveLaw::Model;
  const auto with_nodes = [&]<Model kModel>(std::integral_constant<Model, kModel> model) {
    if (nodes == 4) return of(std::integral_constant<int, 4>{}, model);
    return of(std::integral_constant<int, 10>{}, model);
  };
  if (law.model == Model::kStVk) return with_nodes(std::integral_constant<Model, Model::kStVk>{});
  if (law.model == Model::kCorotated)
    return with_nodes(std::integral_constant<Model, Model::kCorotated>{});
  return with_nodes(std::integral_constant<Model, Model::kNeoHookean>{});
}

void evaluate_cells(const ConstitutiveLaw& law, const FemCells& cells, double* forces, int begin,
                    int end) {
  chosen(law, cells.nodes, [&](auto nodes, auto model) {
    forces_of<nodes.value, model.value>(law, cells, forces, begin, end);
  });
}
double energy_of_cells(const ConstitutiveLaw& law, const FemCells& cells, const int* list,
                       int count) {
  return chosen(law, cells.nodes, [&](auto nodes, auto model) {
    return energy_of<nodes.value, model.value>(law, cells, list, count);
  });
}

constexpr FemKernels kSolid{evaluate_cells, energy_of_cells};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

FemKernels solid_kernels() { return SIM_CHOOSE(kSolid); }

}  // namespace sim
#endif
