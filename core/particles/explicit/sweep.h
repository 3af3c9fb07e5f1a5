// The acceleration of all particles, evaluated block by block, and the update of a method that uses
// each acceleration while it is still in registers.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/explicit/stages.h"
#include "core/particles/motion.h"
#include "core/particles/springs/springs.h"

namespace sim {

// The numbers on a cache line, as many as the widest vectors hold: all arrays of a sweep have room
// for that many before and after.
template <class Real>
inline constexpr int kBlock = 64 / sizeof(Real);

// The bits of a block that owns springs in all lanes.
template <class Real>
inline constexpr unsigned kAllOwn = (1u << kBlock<Real>)-1;

// Sweeps begin at multiples of kGrain particles, whatever the numbers.
inline constexpr int kGrain = kBlock<float>;

// The number of particles whose other forces are gathered at a time: their sums stay in the
// first-level cache.
inline constexpr int kGatherTile = 512;

// Each spring is evaluated once, by its lower end a. Its factor s, of the force s (x_a - x_b) on a,
// waits in a ring until the sweep comes to b = a + stride.
template <class Real>
struct SweepRun : RunColumns {
  // The entries of the ring less 1: a power of two, at least stride + kBlock. Its first vector is
  // repeated after the end.
  std::int64_t mask;
  Real* ring;
  std::int64_t back;  // -stride
  unsigned whole;  // the bits of a block that owns springs in all lanes, if all springs are alike
};

// The rings of one sweep over the runs of several forces. After a whole sweep all that remains in a
// ring is zero, for the last particles own no springs: the next sweep continues where this one
// stopped.
template <class Real>
class Rings {
 public:
  Rings() = default;
  explicit Rings(std::span<const SpringRun* const> runs);

  std::span<const SweepRun<Real>> runs() const { return runs_; }
  void clear();

  std::int64_t turn = 0;  // the position of the next block in every ring, without wraps
  bool of_part = false;   // the last sweep was over a part of the particles: not empty

 private:
  std::vector<SweepRun<Real>> runs_;
  ArrayOf<Real> memory_;
};

template <class Real>
struct SweepKernels {
  // Sweeps [begin, end), begin a multiple of kBlock<Real>, from the present state of the rings.
  // False if a number of v_next, or of q_next in a stage that has v_next, may not be finite.
  bool (*rk)(Rings<Real>& rings, const Motion& motion, const RkStage<Real>& stage, int begin,
             int end);
  bool (*kick)(Rings<Real>& rings, const Motion& motion, const KickStage<Real>& stage, int begin,
               int end);
  // Fills the rings with the springs that particles [begin, end) own, for a sweep that starts at
  // end.
  void (*warm_up)(Rings<Real>& rings, const Real* const q[3], int begin, int end);

  // Makes the rings of one of `ranks` ready for a sweep that starts at `begin`, over springs that
  // reach so many particles far.
  void start(Rings<Real>& rings, int ranks, const Real* const q[3], int begin, int reach) const {
    if (ranks > 1 || rings.of_part) rings.clear();
    rings.of_part = ranks > 1;
    if (ranks > 1) warm_up(rings, q, std::max(0, begin - reach), begin);
  }
};
template <class Real>
SweepKernels<Real> sweep_kernels();  // for this machine

// Adds to `sum` the forces of all runs on particles [i, i + lanes), one spring at a time, for
// distances too large or too small for the fast path. Same order of sums and, for the ordinary
// springs, the same bits.
void add_block_carefully(std::span<const SweepRun<double>> runs, std::int64_t turn,
                         const double* const q[3], int i, int lanes, double (*sum)[8]);

}  // namespace sim
