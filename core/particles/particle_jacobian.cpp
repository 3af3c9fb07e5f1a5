#include "core/particles/particle_jacobian.h"

#include <algorithm>

namespace sim {

ParticleJacobian::ParticleJacobian(Particles& system)
    : system_(&system),
      stiffness_(system),
      others_(system),
      no_shift_(Layout(system.layout().n(), 1).size()) {}

void ParticleJacobian::at(double t, const double* x) {
  view_ = system_->view(t, x);
  const double* const q[3] = {view_.x, view_.y, view_.z};
  stiffness_.at(q, {});
  others_.at(view_);
}

void ParticleJacobian::apply(const double* dx, double* df) {
  const Layout& layout = system_->layout();
  const Motion& motion = system_->motion();
  const auto dq = layout.axes(dx), dv = layout.axes(dx, 3);
  const auto df_q = layout.axes(df), df_v = layout.axes(df, 3);

  StiffProduct product{};
  std::ranges::copy(dq, product.p);
  std::ranges::copy(df_v, product.out);
  product.shift = Layout(layout.n(), 1).block(no_shift_.data(), 0);
  product.scale = -1;
  product.free = motion.free;
  system_->pool().run_parts(layout.n(), 8, [&](int begin, int end) {
    double sums[8] = {};
    stiffness_.apply(product, begin, end, sums);
  });
  if (!others_.empty()) others_.add(dq.data(), dv.data(), {df_v[0], df_v[1], df_v[2]});
  system_->pool().run_parts(layout.n(), 8, [&](int begin, int end) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = begin; i < end; ++i) {
        df_q[axis][i] = dv[axis][i];
        df_v[axis][i] = (df_v[axis][i] - motion.damping * dv[axis][i]) / view_.mass[i];
      }
  });
}

}  // namespace sim
