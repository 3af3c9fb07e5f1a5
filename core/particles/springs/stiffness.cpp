#include "core/particles/springs/stiffness.h"

#include <algorithm>
#include <cmath>

#include "core/base/assert.h"
#include "core/simd/inverse_sqrt.h"

namespace sim {

SpringStiffness spring_stiffness(const Vec3& d, double k, double rest, bool clamped) {
  const double square = square_of(d[0], d[1], d[2]);
  double inverse = inverse_sqrt(square);
  if (inverse != inverse) {
    // r/|d| is negligible where the square overflows.
    if (rest == 0 || !(square > kSafeLeast && square < kSafeMost)) return {k, 0};
    inverse = 1 / std::sqrt(square);
  }
  double pull = (k * rest) * inverse;
  if (clamped) pull = pull < k ? pull : k;
  return {k - pull, (pull * inverse) * inverse};
}

SpringStiffness predicted_stiffness(const Vec3& d, const Vec3& before, double k, double rest,
                                    bool clamped) {
  const double square = square_of(d[0], d[1], d[2]);
  const double square_before = square_of(before[0], before[1], before[2]);
  const double inverse = inverse_sqrt(square), inverse_before = inverse_sqrt(square_before);
  const double reach = d.dot(before) * inverse_before;
  if (rest == 0 || !(reach * inverse > 0.5)) return spring_stiffness(d, k, rest, clamped);
  double along = (k * reach - k * rest) * inverse;
  if (clamped) along = along > 0 ? along : 0;
  return {along, ((k - along) * inverse) * inverse};
}

namespace {

Vec3 difference_of(const double* const q[3], std::int64_t a, std::int64_t b) {
  return {q[0][a] - q[0][b], q[1][a] - q[1][b], q[2][a] - q[2][b]};
}

SpringStiffness stiffness_of(const double* const q[3], std::int64_t a, std::int64_t b,
                             SpringSense sense, double k, double rest, const SpringModel& model) {
  const Vec3 d = difference_of(q, a, b);
  if (sense != SpringSense::kBoth && slack(sense, length(d), rest)) return {};
  if (!model.before) return spring_stiffness(d, k, rest, model.clamped);
  return predicted_stiffness(d, difference_of(model.before, a, b), k, rest, model.clamped);
}

// k = along + across |d|^2 is unchanged.
SpringStiffness softer(const SpringStiffness& spring, double share, double k) {
  const double along = spring.along * share;
  return {along, spring.across * ((k - along) / (k - spring.along))};
}

}  // namespace

void linearise_carefully(const StiffRun& run, const double* const q[3], const SpringModel& model,
                         int i, int lanes) {
  SIM_ASSERT(i >= 0 && 0 < lanes && lanes <= 8);
  for (int a = i; a < i + lanes; ++a) {
    if (!bit(run.owners, a)) continue;
    const auto [along, across] =
        stiffness_of(q, a, a + run.stride, run.sense, run.k_of(a), run.rest_of(a), model);
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
  shares_ = Array(Layout(system.layout().n(), 1).size());
}

void Stiffness::at(const double* const q[3], const SpringModel& model) {
  std::copy_n(q, 3, q_);
  system_->pool().run_parts(system_->layout().n(), 8, [&](int begin, int end) {
    for (const StiffRun& run : runs_) kernels_.linearise(run, q, model, begin, end);
    for (StiffNet& net : nets_)
      for (int i = begin; i < end; ++i)
        net.linearise(i, [&](int to, double k, double rest) {
          return stiffness_of(q, i, to, net.sense(), k, rest, model);
        });
  });
}

void Stiffness::find_parts(const double* shift, double scale, const std::uint8_t* free,
                           double most_share, double* parts) const {
  SIM_ASSERT(scale >= 0 && most_share >= 0);
  system_->pool().run_parts(system_->layout().n(), 8, [&](int begin, int end) {
    std::fill(parts + begin, parts + end, 0.0);
    kernels_.pushes(runs_, parts, begin, end);
    for (int i = begin; i < end; ++i) {
      double& share = parts[i];
      if (!nets_.empty())
        net_at(i, [&](int, const SpringStiffness& spring) {
          if (spring.along < 0) share -= spring.along;
        });
      const double most = most_share * shift[i], push = 2 * scale * share;
      share = bit(free, i) && push > most ? most / push : 1.0;
    }
  });
}

void Stiffness::soften(const double* shift, double scale, const std::uint8_t* free,
                       double most_share) {
  double* const shares = Layout(system_->layout().n(), 1).block(shares_.data(), 0);
  find_parts(shift, scale, free, most_share, shares);
  system_->pool().run_parts(system_->layout().n(), 8, [&](int begin, int end) {
    for (const StiffRun& run : runs_) kernels_.soften(run, shares, begin, end);
    for (StiffNet& net : nets_)
      for (int i = begin; i < end; ++i)
        net.change(i, [&](int to, double k, const SpringStiffness& spring) {
          const double share = std::min(shares[i], shares[to]);
          return spring.along < 0 && share < 1 ? softer(spring, share, k) : spring;
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
