#include "core/particles/springs/stiffness.h"

#include <algorithm>
#include <cmath>

#include "core/simd/inverse_sqrt.h"

namespace sim {

SpringStiffness spring_stiffness(const Vec3& d, double k, double rest, bool clamped) {
  const double square = square_of(d[0], d[1], d[2]);
  double inverse = inverse_sqrt(square);
  if (inverse != inverse) {
    // Where the square overflows r/|d| is nothing.
    if (rest == 0 || !(square > kSafeLeast && square < kSafeMost)) return {k, 0};
    inverse = 1 / std::sqrt(square);
  }
  double pull = (k * rest) * inverse;
  if (clamped) pull = pull < k ? pull : k;
  return {k - pull, (pull * inverse) * inverse};
}

void linearise_carefully(const StiffRun& run, const double* const q[3], bool clamped, int i,
                         int lanes) {
  for (int a = i; a < i + lanes; ++a) {
    if (!bit(run.owners, a)) continue;
    const std::int64_t b = a + run.stride;
    const Vec3 d(q[0][a] - q[0][b], q[1][a] - q[1][b], q[2][a] - q[2][b]);
    const auto [along, across] = spring_stiffness(d, run.k_of(a), run.rest_of(a), clamped);
    run.along[a] = along;
    run.across[a] = across;
  }
}

Stiffness::Stiffness(const Particles& system) : system_(&system), kernels_(stiff_kernels()) {
  const int count = static_cast<int>(system.runs().size());
  const Layout layout(system.layout().n(), 2 * count);
  memory_ = Array(layout.size());
  for (int r = 0; r < count; ++r) {
    runs_.push_back({RunColumns(*system.runs()[static_cast<std::size_t>(r)]),
                     layout.block(memory_.data(), 2 * r), layout.block(memory_.data(), 2 * r + 1)});
  }
  for (const Net* net : system.nets()) nets_.emplace_back(*net, system.layout().n());
}

void Stiffness::at(const double* const q[3], bool clamped) {
  std::copy_n(q, 3, q_);
  system_->team().run_parts(system_->layout().n(), 8, [&](int begin, int end) {
    for (const StiffRun& run : runs_) kernels_.linearise(run, q, clamped, begin, end);
    for (StiffNet& net : nets_)
      for (int i = begin; i < end; ++i)
        net.linearise(i, [&](int to, double k, double rest) {
          return spring_stiffness(position(i) - position(to), k, rest, clamped);
        });
  });
}

void Stiffness::apply(StiffProduct f, int begin, int end, double (&sums)[8]) const {
  std::copy_n(q_, 3, f.q);
  if (!nets_.empty()) {
    f.before = true;
    for (int i = begin; i < end; ++i) {
      Vec3 sum = Vec3::Zero();
      const Vec3 p(f.p[0][i], f.p[1][i], f.p[2][i]);
      net_at(i, [&](int to, const SpringStiffness& stiffness) {
        const Vec3 d = position(i) - position(to);
        const Vec3 e = p - Vec3(f.p[0][to], f.p[1][to], f.p[2][to]);
        sum += stiffness.along * e + (stiffness.across * d.dot(e)) * d;
      });
      for (int axis = 0; axis < 3; ++axis) f.out[axis][i] = sum[axis];
    }
  }
  kernels_.product(runs_, f, begin, end, sums);
}

void Stiffness::diagonal(const double* shift, double scale, double* const blocks[6], int begin,
                         int end) const {
  kernels_.diagonal(runs_, q_, shift, scale, blocks, begin, end);
  if (nets_.empty()) return;
  for (int i = begin; i < end; ++i)
    net_at(i, [&](int to, const SpringStiffness& stiffness) {
      const Vec3 d = position(i) - position(to);
      int entry = 0;
      for (int row = 0; row < 3; ++row)
        for (int col = row; col < 3; ++col)
          blocks[entry++][i] +=
              scale * (stiffness.across * d[row] * d[col] + (row == col ? stiffness.along : 0.0));
    });
}

}  // namespace sim
