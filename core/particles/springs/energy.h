// The elastic energy of spring runs.
#pragma once

#include "core/particles/springs/springs.h"

namespace sim {

// Energy in J of the springs of the run that particles [begin, end) own; begin is a multiple of 8.
// The sum is taken in eight lanes (particle mod 8), so that it has the same bits everywhere.
double run_energy(const SpringRun& run, const ParticleView& view, int begin, int end);

// The same before the lanes are added. False when some |d|^2 may have underflowed or overflowed.
using RunEnergies = bool (*)(const RunColumns& run, const double* const q[3], int begin, int end,
                             double (&lanes)[8]);
RunEnergies run_energies();  // for this machine

}  // namespace sim
