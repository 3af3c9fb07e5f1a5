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

// R = dL/dF of L = tr S, F = R S, the largest root of
//   L^4 - 2 I L^2 - 8 J L + I^2 - 4 |cof F|^2,  I = |F|^2
// (Lin, Chitalu & Komura (2022), Isotropic ARAP energy using Cauchy-Green invariants):
//   R = ((L^2 + I) F + 2 L cof F - 2 F C) / (L^3 - I L - 2 J).
// Newton's method falls to L from sqrt(3 I) above it; the number of its steps is fixed, and enough
// unless two stretches of an inverted cell nearly cancel, where R jumps. There 1 stands for R.
constexpr int kNewtonSteps = 10;

// P = 2 mu (F - R) + lambda (R:F - 3) R.
SIM_INLINE Rows corotated(const ConstitutiveLaw& law, const Rows& F) {
  const Doubles zero{}, one = splat<double>(1), two = splat<double>(2), four = splat<double>(4);
  const Rows cofactors = cofactor_rows(F);
  const Symmetric C = gram(F);
  const Doubles I = C.xx + C.yy + C.zz, J = dotted(F.row[0], cofactors.row[0]);
  const Doubles squares = dotted(cofactors.row[0], cofactors.row[0]) +
                          dotted(cofactors.row[1], cofactors.row[1]) +
                          dotted(cofactors.row[2], cofactors.row[2]);
  const Doubles rest = fma(I, I, -(four * squares)), eight_J = splat<double>(8) * J;
  Doubles L = square_root(splat<double>(3) * I);
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Doubles q = L * L, slope = fma(four * (q - I), L, -eight_J);
    const Doubles value = fma(fma(q - two * I, L, -eight_J), L, rest);
    L -= slope > zero ? value / slope : zero;
  }
  const Doubles below = fma(fma(L, L, -I), L, -(two * J));
  const auto turns = below > splat<double>(1e-12) * I * L;
  const Doubles scale = turns ? one / below : zero, diagonal = turns ? zero : one;
  const Doubles by_F = scale * fma(L, L, I), by_J = two * L * scale, by_C = -(two * scale);
  Rows R, P;
  Doubles stretch = zero;
  for (int i = 0; i < 3; ++i) {
    R.row[i] = times_plus(by_F, F.row[i],
                          times_plus(by_J, cofactors.row[i], times(by_C, product(F.row[i], C))));
    (i == 0 ? R.row[i].x : i == 1 ? R.row[i].y : R.row[i].z) += diagonal;
    P.row[i] = F.row[i] - R.row[i];
    stretch += dotted(R.row[i], P.row[i]);
  }
  const Doubles mu = splat<double>(2 * law.mu), by_R = splat<double>(law.lambda) * stretch;
  for (int i = 0; i < 3; ++i) P.row[i] = times_plus(by_R, R.row[i], times(mu, P.row[i]));
  return P;
}

// f_a = -sum over the points of w P grad N_a, and f_0 = -sum of the others.
template <int kNodes, ConstitutiveLaw::Model kModel>
void forces_of(const ConstitutiveLaw& law, const FemCells& cells, int begin, int end) {
  constexpr int points = kNodes == 4 ? 1 : 4, columns = 3 * (kNodes - 1) + 1;
  for (int block = begin; block < end; ++block)
    for (int lane = 0; lane < kSideBySide; lane += kDoubles) {
      const std::ptrdiff_t at = block;
      const std::int32_t* const ids = cells.ids + at * kNodes * kSideBySide + lane;
      const V3<double> first = gather(cells.points, ids);
      V3<double> d[kNodes - 1], f[kNodes - 1];
      for (int a = 0; a < kNodes - 1; ++a) {
        d[a] = gather(cells.points, ids + (a + 1) * kSideBySide) - first;
        f[a] = V3<double>{};
      }
      for (int point = 0; point < points; ++point) {
        const double* const rest =
            cells.rest + (at * points + point) * columns * kSideBySide + lane;
        const auto gradient = [&](int a) __attribute__((always_inline)) {
          const double* const g = rest + (1 + 3 * a) * kSideBySide;
          return V3<double>{load(g), load(g + kSideBySide), load(g + 2 * kSideBySide)};
        };
        Rows F{};
        for (int a = 0; a < kNodes - 1; ++a) {
          const V3<double> g = gradient(a);
          F.row[0] = times_plus(d[a].x, g, F.row[0]);
          F.row[1] = times_plus(d[a].y, g, F.row[1]);
          F.row[2] = times_plus(d[a].z, g, F.row[2]);
        }
        Rows P = kModel == ConstitutiveLaw::Model::kStVk        ? st_venant_kirchhoff(law, F)
                 : kModel == ConstitutiveLaw::Model::kCorotated ? corotated(law, F)
                                                                : neo_hookean(law, F);
        const Doubles w = load(rest);
        for (int i = 0; i < 3; ++i) P.row[i] = times(w, P.row[i]);
        for (int a = 0; a < kNodes - 1; ++a) {
          const V3<double> g = gradient(a);
          f[a].x -= dotted(P.row[0], g);
          f[a].y -= dotted(P.row[1], g);
          f[a].z -= dotted(P.row[2], g);
        }
      }
      double* const out = cells.forces + at * kNodes * 3 * kSideBySide + lane;
      V3<double> sum{};
      for (int a = 0; a < kNodes - 1; ++a) {
        double* const to = out + (a + 1) * 3 * kSideBySide;
        store(to, f[a].x);
        store(to + kSideBySide, f[a].y);
        store(to + 2 * kSideBySide, f[a].z);
        sum = sum - f[a];
      }
      store(out, sum.x);
      store(out + kSideBySide, sum.y);
      store(out + 2 * kSideBySide, sum.z);
    }
}

template <int kNodes>
void of_nodes(const ConstitutiveLaw& law, const FemCells& cells, int begin, int end) {
  using Model = ConstitutiveLaw::Model;
  if (law.model == Model::kStVk) return forces_of<kNodes, Model::kStVk>(law, cells, begin, end);
  if (law.model == Model::kCorotated)
    return forces_of<kNodes, Model::kCorotated>(law, cells, begin, end);
  forces_of<kNodes, Model::kNeoHookean>(law, cells, begin, end);
}

void evaluate_cells(const ConstitutiveLaw& law, const FemCells& cells, int begin, int end) {
  if (cells.nodes == 4) return of_nodes<4>(law, cells, begin, end);
  of_nodes<10>(law, cells, begin, end);
}

constexpr FemKernels kSolid{evaluate_cells};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

FemKernels solid_kernels() { return SIM_CHOOSE(kSolid); }

}  // namespace sim
#endif
