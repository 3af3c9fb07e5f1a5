// What holds particles together while some of them lie on colliders: forces, as accelerations want
// them, for those who look.
#pragma once

#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/constraints/pushes.h"
#include "core/particles/particles.h"

namespace sim {

class TouchingForces {
 public:
  // count: of the particles that touch colliders, the first.
  TouchingForces(Particles& particles, const Constraints& constraints, int count);

  // N, of each row at this state: with J a + bias = 0, and surfaces that push what lies on them.
  // values: of the rows there. Without surfaces where that has no end.
  std::span<const double> multipliers(const ParticleView& now, const RowValues& values);

 private:
  void find(const ParticleView& now, const Constraints::Axes& a);

  Particles* particles_;
  int count_;
  PushSolver solver_;
  Array a_;
  std::vector<Push> pushes_;
};

}  // namespace sim
