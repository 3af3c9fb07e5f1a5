#include "core/particles/springs/energy.h"

#include "core/simd/lanes.h"

namespace sim {

double run_energy(const SpringRun& run, const ParticleView& view, int begin, int end) {
  const double* const q[3] = {view.x, view.y, view.z};
  double lanes[8] = {};
  if (!run_energies()(RunColumns(run), q, begin, end, lanes)) {
    // One spring at a time, with each |d| free of overflow, in the same order of summation.
    for (double& lane : lanes) lane = 0;
    for (int a = begin; a < end; ++a) {
      if (!run.owns(a)) continue;
      const double strain = spring_stretch(
          run.sense, view.position(a) - view.position(a + run.stride), run.rest_of(a));
      lanes[a % 8] += (0.5 * run.k_of(a)) * (strain * strain);
    }
  }
  return sum_of(lanes);
}

}  // namespace sim
