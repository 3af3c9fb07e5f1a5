#include "core/particles/springs/dashpots.h"

#include <cmath>

#include "core/base/assert.h"
#include "core/simd/inverse_sqrt.h"

namespace sim {
namespace {

bool safe(double square) { return square > kSafeLeast && square < kSafeMost; }

Vec3 between(const double* x, const double* y, const double* z, std::int64_t a, std::int64_t b) {
  return {x[a] - x[b], y[a] - y[b], z[a] - z[b]};
}
Vec3 position(const ParticleView& p, std::int64_t a, std::int64_t b) {
  return between(p.x, p.y, p.z, a, b);
}
Vec3 velocity(const ParticleView& p, std::int64_t a, std::int64_t b) {
  return between(p.vx, p.vy, p.vz, a, b);
}

// sum += the force on a of its dashpot to b, as the vector code adds it.
void add_force(const ParticleView& p, std::int64_t a, std::int64_t b, double c,
               double* const sum[3]) {
  const Vec3 d = position(p, a, b), w = velocity(p, a, b);
  const double square = square_of(d[0], d[1], d[2]);
  if (safe(square)) {
    const double s = -c * (std::fma(w[2], d[2], std::fma(w[1], d[1], w[0] * d[0])) / square);
    for (int axis = 0; axis < 3; ++axis) *sum[axis] = std::fma(s, d[axis], *sum[axis]);
  } else {
    const Vec3 force = dashpot_force(d, w, c);
    for (int axis = 0; axis < 3; ++axis) *sum[axis] += force[axis];
  }
}

}  // namespace

Vec3 dashpot_force(const Vec3& d, const Vec3& w, double c) {
  // d = scale u with components of u in [-1, 1], one of them 1 or -1.
  const double scale = d.cwiseAbs().maxCoeff();
  if (scale == 0) return Vec3::Zero();
  const Vec3 u = d / scale;
  return (-c * (w.dot(u) / u.squaredNorm())) * u;
}

void add_dashpots_carefully(std::span<const DashpotRun> runs, const ParticleView& view, int i,
                            int lanes, double (*sum)[8]) {
  SIM_ASSERT(i >= 0 && 0 < lanes && lanes <= 8);
  for (const DashpotRun& run : runs)
    for (int lane = 0; lane < lanes; ++lane) {
      const std::int64_t at = i + lane;
      if (at >= view.n) break;
      double* const to[3] = {&sum[0][lane], &sum[1][lane], &sum[2][lane]};
      const auto add = [&](std::int64_t owner, std::int64_t other) {
        const double c = run.c[owner];
        if (c == 0 || (run.sense != SpringSense::kBoth &&
                       slack(run.sense, length(position(view, at, other)), run.rest[owner])))
          return;
        add_force(view, at, other, c, to);
      };
      add(at, at + run.stride);
      if (at >= run.stride) add(at - run.stride, at - run.stride);
    }
}

Dashpots::Dashpots(int n, const std::function<void(const Springs::Visit&)>& for_each,
                   SpringSense sense, bool breakable)
    : pairs_(n, for_each, sense, breakable) {
  for (const SpringRun& run : pairs_.runs()) {
    if (!run.uniform) {
      const bool gated = sense != SpringSense::kBoth;
      runs_.push_back({run.ks.data() + SpringRun::kPad, run.stride, sense,
                       gated ? run.rests.data() + SpringRun::kPad : nullptr});
      continue;
    }
    c_.emplace_back(static_cast<std::size_t>(n + 2 * SpringRun::kPad));
    double* const c = c_.back().data() + SpringRun::kPad;
    for (int a = 0; a + run.stride < n; ++a)
      if (run.owns(a)) c[a] = run.k_of(a);
    runs_.push_back({c, run.stride});
  }
}

void Dashpots::accumulate(const ParticleView& view, Tile tile, ForceSink sink) const {
  SIM_ASSERT(0 <= tile.begin && tile.begin <= tile.end && tile.end <= view.n);
  forces_(runs_, view, tile.begin, tile.end, sink);
  if (pairs_.net().empty()) return;
  const Tile used = pairs_.net().used(tile);
  for (int i = used.begin; i < used.end; ++i)
    pairs_.net().at(i, [&](int to, double c, double rest) {
      if (!acts(position(view, i, to), rest)) return;
      double* const sum[3] = {sink.x + i, sink.y + i, sink.z + i};
      add_force(view, i, to, c, sum);
    });
}

void Dashpots::couplings(std::vector<std::array<int, 2>>& pairs) const {
  for (int i = 0; i < pairs_.particles(); ++i)
    pairs_.with_broken_at(i, [&](int to, double, double) {
      if (i < to) pairs.push_back({i, to});
    });
}

void Dashpots::jacobian(const ParticleView& view, JacobianSink& sink) const {
  for (int i = 0; i < view.n; ++i) {
    Mat3 of_position = Mat3::Zero(), of_velocity = Mat3::Zero();
    bool any = false;
    pairs_.at(i, [&](int to, double c, double rest) {
      const Vec3 d = position(view, i, to), w = velocity(view, i, to);
      if (!acts(d, rest)) return;
      const double square = square_of(d[0], d[1], d[2]);
      Mat3 along = Mat3::Zero(), across = Mat3::Zero();
      if (safe(square)) {
        const double rho = w.dot(d) / square;
        along = outer((c / square) * d, d);
        across = c * rho * Mat3::Identity() + outer((c / square) * d, w - 2 * rho * d);
      }
      sink.position(i, to, across);
      sink.velocity(i, to, along);
      of_position -= across;
      of_velocity -= along;
      any = true;
    });
    if (!any) continue;
    sink.position(i, i, of_position);
    sink.velocity(i, i, of_velocity);
  }
}

}  // namespace sim
