#include "core/particles/springs/near_points.h"

#include <algorithm>

namespace sim {
namespace {

// The condition |d| <= share rest + ahead |v| implies d^2 <= 2 (share^2 rest^2 + ahead^2 v^2),
// which needs no square root.
struct Sieve {
  const ParticleView& p;
  double ahead2, share2;

  bool passes(int a, int b, double rest) const {
    const double x = p.x[a] - p.x[b], y = p.y[a] - p.y[b], z = p.z[a] - p.z[b];
    const double u = p.vx[a] - p.vx[b], v = p.vy[a] - p.vy[b], w = p.vz[a] - p.vz[b];
    return x * x + y * y + z * z <= 2 * (share2 * rest * rest + ahead2 * (u * u + v * v + w * w));
  }
};

// Most blocks contain no candidate: each is first tested as a whole, without branches.
void visit(const SpringRun& run, const Sieve& sieve, const Springs::Visit& visit) {
  constexpr int kBlock = 256;
  const int end = sieve.p.n - run.stride;
  for (int begin = 0; begin < end; begin += kBlock) {
    const int to = std::min(end, begin + kBlock);
    int any = 0;
    if (run.uniform)
      for (int a = begin; a < to; ++a) any |= sieve.passes(a, a + run.stride, run.rest);
    else
      for (int a = begin; a < to; ++a) any |= sieve.passes(a, a + run.stride, run.rest_of(a));
    if (!any) continue;
    for (int a = begin; a < to; ++a)
      if (run.owns(a) && sieve.passes(a, a + run.stride, run.rest_of(a)))
        visit(a, a + run.stride, run.k_of(a), run.rest_of(a));
  }
}

}  // namespace

void visit_near_points(const Springs& springs, const ParticleView& p, double ahead, double share,
                       const Springs::Visit& visit_one) {
  const Sieve sieve{p, ahead * ahead, share * share};
  for (const SpringRun& run : springs.runs()) visit(run, sieve, visit_one);
  if (springs.net().empty()) return;
  for (int a = 0; a < p.n; ++a)
    springs.net().at(a, [&](int b, double k, double rest) {
      if (a < b && sieve.passes(a, b, rest)) visit_one(a, b, k, rest);
    });
}

}  // namespace sim
