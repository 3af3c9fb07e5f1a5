// One evaluation of the acceleration of all particles, block by block, and what a method does with
// each acceleration while it is still in registers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/springs.h"

namespace sim {

// Each spring is evaluated once, by its lower end a. The force waits in a ring until the sweep
// comes to a + stride. After a whole sweep all that is left in a ring is zero, for the last
// particles own no springs: the next sweep goes on where this one stopped.
struct SweepRun {
  const std::uint8_t* owners;
  const double *ks, *rests;  // null in a uniform run
  double k, k_rest;
  std::int64_t stride;
  std::int64_t size;    // of the ring, a multiple of 8, at least stride + 8
  std::int64_t cursor;  // where the next block goes, a multiple of 8
  double* ring;         // three parts (x, y, z) of size + 8: the first 8 stand again at the end
};

// The rings of one sweep over the runs of several forces.
class Rings {
 public:
  Rings() = default;
  explicit Rings(std::span<const SpringRun* const> runs);

  std::span<SweepRun> runs() { return runs_; }
  void clear();

 private:
  std::vector<SweepRun> runs_;
  Array memory_;
};

// q' = v, v' = F(q) / m + g - (c / m) v, as far as it is the same for all forces and methods.
struct Motion {
  const std::uint8_t* free = nullptr;      // a bit a particle; 0 where pinned
  const double* inverse_masses = nullptr;  // 1/kg, null when all free particles have the same
  double inverse_mass = 0;                 // 1/kg
  double gravity[3] = {};                  // m/s^2
  double damping = 0;                      // kg/s
};

// sum_j coef_j a_j over earlier accelerations a_j.
struct Row {
  static constexpr int kMost = 16;
  int terms = 0;
  double coef[kMost];
  const double* a[kMost][3];

  void add(double c, const double* const from[3]) {
    coef[terms] = c;
    for (int axis = 0; axis < 3; ++axis) a[terms][axis] = from[axis];
    ++terms;
  }
};

// One stage of a Runge-Kutta method on particles: a = the acceleration at the positions q and the
// velocity v0 + v_now, and from it the positions of the next stage and the final velocity.
struct RkStage {
  const double* q[3];   // positions of this stage
  const double* q0[3];  // at the start of the step
  const double* v0[3];
  const double* force[3];  // forces gathered before, or null
  Row v_now;
  double* a[3];       // kept for later rows, or null
  double* q_next[3];  // := q0 + drift v0 + row, or null
  double drift;
  Row q_row;
  double* v_next[3];  // := v0 + row + kick a, or null
  double kick;
  Row v_row;
  bool check;  // look for numbers that are not finite in q_next and v_next
};

// Sweeps [begin, end), begin a multiple of 8, on from where the rings stand. False when `check`
// found something that may not be finite.
using RkSweep = bool (*)(std::span<SweepRun> runs, const Motion& motion, const RkStage& stage,
                         int begin, int end);

// Fills the rings with the springs that particles [begin, end) own, for a sweep that starts at end.
using WarmUp = void (*)(std::span<SweepRun> runs, const double* const q[3], int begin, int end);

struct SweepKernels {
  RkSweep rk;
  WarmUp warm_up;
};
SweepKernels sweep_kernels();

}  // namespace sim
