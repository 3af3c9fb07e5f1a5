// The exact derivative of the particle system.
#pragma once

#include "core/ode/ode_system.h"
#include "core/particles/particles.h"
#include "core/particles/plugin_force_jacobian.h"
#include "core/particles/springs/stiffness.h"

namespace sim {

//   q' = v, v' = F/m + g - (c/m) v:  df_q = dv,  df_v = (-K dq - c dv + dF_other) / m
// with K summed over the springs, and df_v = 0 where pinned. Arrays are in the system's layout.
class ParticleJacobian final : public Jacobian {
 public:
  explicit ParticleJacobian(Particles& system);

  void at(double t, const double* x) override;
  void apply(const double* dx, double* df) override;

 private:
  Particles* system_;
  Stiffness stiffness_;
  PluginForceJacobian others_;
  Array no_shift_;
  ParticleView view_;
};

}  // namespace sim
