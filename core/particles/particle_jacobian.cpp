#include "core/particles/particle_jacobian.h"

#include <algorithm>

#include "core/particles/spring_stiffness.h"

namespace sim {

ParticleJacobian::ParticleJacobian(ParticleSystem& system)
    : system_(&system), others_(system.other_forces(), system.layout().n()) {}

void ParticleJacobian::at(double t, const double* x) {
  view_ = system_->view(t, x);
  others_.at(view_);
}

void ParticleJacobian::apply(const double* dx, double* df) {
  const Layout& layout = system_->layout();
  const Motion& motion = system_->motion();
  const ParticleView d = system_->view(0, dx);
  double* out[6];
  for (int block = 0; block < 6; ++block) out[block] = layout.block(df, block);
  std::fill(df, df + layout.size(), 0.0);

  const ForceSink sink{out[3], out[4], out[5]};
  if (!others_.empty()) {
    const double* const dq[3] = {d.x, d.y, d.z};
    const double* const dv[3] = {d.vx, d.vy, d.vz};
    others_.add(dq, dv, sink);
  }
  system_->team().run([&](int rank) {
    const Part part = part_of(layout.n(), 8, rank, system_->team().size());
    for (int i = part.begin; i < part.end; ++i) {
      const Vec3 v = d.velocity(i);
      for (int axis = 0; axis < 3; ++axis) out[axis][i] = v[axis];
      Vec3 sum(sink.x[i], sink.y[i], sink.z[i]);
      for (const auto& force : system_->forces()) {
        const Springs* springs = force->springs();
        if (!springs) continue;
        springs->at(i, [&](int j, double k, double rest) {
          const Vec3 span = view_.position(i) - view_.position(j);
          const Vec3 change = d.position(i) - d.position(j);
          const auto [along, across] = spring_stiffness(span, k, rest);
          sum -= along * change + (across * span.dot(change)) * span;
        });
      }
      const Vec3 a = (sum - motion.damping * v) / view_.mass[i];
      for (int axis = 0; axis < 3; ++axis) out[3 + axis][i] = view_.free(i) ? a[axis] : 0.0;
    }
  });
}

}  // namespace sim
