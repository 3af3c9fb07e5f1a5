#include "core/particles/rigid/rigid_rows.h"

#include <algorithm>

namespace sim {

RowPattern RigidRows::pattern() const {
  RowPattern pattern;
  for (const RigidBody& body : bodies_) {
    const int a = body.first();
    for (int row = 0; row < kRows; ++row) pattern.add({a, a + 1, a + 2, a + 3});
  }
  return pattern;
}

// phi = s (d_k.d_l - [k = l]), halved for k = l, with s the smaller of both extents, so that it is
// in m.
void RigidRows::evaluate_some(const ParticleView& view, const Rows& rows, int begin,
                              int end) const {
  constexpr std::size_t kPairs[kRows][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {2, 0}, {0, 1}};
  auto row = static_cast<std::size_t>(kRows * begin);
  Vec3* gradient = rows.gradient + kRows * RigidBody::kParticles * begin;
  for (int i = begin; i < end; ++i) {
    const RigidBody& body = bodies_[static_cast<std::size_t>(i)];
    const Vec3& extent = body.extent();
    const auto [d, rate] =
        body.directors(view, view.position(body.first()), view.velocity(body.first()));
    for (const auto& [k, l] : kPairs) {
      const double scale = (k == l ? 0.5 : 1) * std::min(extent[k], extent[l]);
      rows.phi[row] = scale * (d[k].dot(d[l]) - (k == l ? 1 : 0));
      rows.drive[row] = 0;
      rows.bias[row++] = 2 * scale * rate[k].dot(rate[l]);
      const Vec3 by_k = body.share()[k] * d[l], by_l = body.share()[l] * d[k];
      for (int p = 0; p < RigidBody::kParticles; ++p)
        *gradient++ = scale * (RigidBody::sign(p, k) * by_k + RigidBody::sign(p, l) * by_l);
    }
  }
}

void RigidRows::evaluate(const ParticleView& view, const Rows& rows) const {
  constexpr int kWorthThreads = 256;  // bodies
  pool_->run_if_many(static_cast<int>(bodies_.size()), kWorthThreads,
                     [&](int begin, int end) { evaluate_some(view, rows, begin, end); });
}

}  // namespace sim
