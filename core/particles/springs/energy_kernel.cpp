#include "core/particles/springs/energy.h"
#include "core/simd/inverse_sqrt.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/springs/energy_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/particles/springs/spring_kernel.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// Summed in eight lanes, whatever the width of a vector.
bool run_energies(const RunColumns& run, const double* const q[3], int begin, int end,
                  double (&lanes)[8]) {
  constexpr int kParts = 8 / kDoubles;
  Doubles sums[kParts] = {}, least = splat<double>(1), most = splat<double>(1);
  for (int block = begin; block < end; block += 8)
    for (int part = 0; part < kParts; ++part) {
      const int i = block + part * kDoubles;
      const unsigned bits = block_bits<double>(run.owners, i);
      if (!bits) continue;
      const Doubles square = squared(difference(run, q, i));
      const Doubles kept = keep(bits, square - splat<double>(1)) + splat<double>(1);
      least = kept < least ? kept : least;
      most = kept > most ? kept : most;
      const Doubles rest = run.ks ? load(run.rests + i) : splat<double>(run.rest);
      const Doubles k = run.ks ? taut_stiffness<double>(run.sense, load(run.ks + i), rest, square)
                               : splat<double>(run.k);
      const Doubles strain = square_root(square) - rest;
      sums[part] += keep(bits, (0.5 * k) * (strain * strain));
    }
  add_lanes(sums, lanes);
  for (int lane = 0; lane < kDoubles; ++lane)
    if (!(least[lane] > kSafeLeast && most[lane] < kSafeMost)) return false;
  return true;
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

RunEnergies run_energies() { return SIM_CHOOSE(run_energies); }

}  // namespace sim
#endif
