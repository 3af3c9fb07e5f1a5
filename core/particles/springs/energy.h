// The elastic energy of spring runs.
#pragma once

#include "core/particles/springs/springs.h"

namespace sim {

// Energy in J of the springs of the run that particles [begin, end) own; begin is a multiple of 8.
// The sum is taken in eight lanes (particle mod 8), so that it has the same bits everywhere.
double run_energy(const SpringRun& run, const ParticleView& view, int begin, int end);

}  // namespace sim
