#include "core/particles/springs/dashpots.h"
#include "core/simd/inverse_sqrt.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/springs/dashpot_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/particles/springs/spring_kernel.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// The particles of a block, their sums, and the range of lengths of their dashpots.
struct Here {
  V3<double> q, v, sum;
  Doubles least, most;  // |d|^2 of all dashpots
};

// here.sum += -c (w.d) / |d|^2 d for the dashpots to the particles from j on, which belong to those
// from `owner` on.
SIM_INLINE void add_dashpots(const DashpotRun& run, std::int64_t owner, const double* const q[3],
                             const double* const v[3], std::int64_t j, Here& here) {
  const Doubles none{}, one = splat<double>(1);
  const V3<double> d = here.q - load(q, j), w = here.v - load(v, j);
  Doubles c = load(run.c + owner);
  if (run.sense != SpringSense::kBoth)
    c = taut_stiffness<double>(run.sense, c, load(run.rest + owner), squared(d));
  const Doubles square = c != none ? squared(d) : one;
  here.least = square < here.least ? square : here.least;
  here.most = square > here.most ? square : here.most;
  const Doubles rho = fma(w.z, d.z, fma(w.y, d.y, w.x * d.x)) / square;
  add_scaled(c != none ? -c * rho : none, d, here.sum);
}

// The forces of all runs on the particles from i on.
SIM_INLINE V3<double> dashpot_block(std::span<const DashpotRun> runs, const ParticleView& view,
                                    int i) {
  const double* const q[3] = {view.x, view.y, view.z};
  const double* const v[3] = {view.vx, view.vy, view.vz};
  Here here{load(q, i), load(v, i), {}, splat<double>(1), splat<double>(1)};
  for (const DashpotRun& run : runs) {
    if (i + run.stride < view.n) add_dashpots(run, i, q, v, i + run.stride, here);
    if (i + kDoubles > run.stride) add_dashpots(run, i - run.stride, q, v, i - run.stride, here);
  }
  // The check also catches a distance that overflowed in a lane without a dashpot.
  const Doubles zero{};
  const Doubles range = here.most + splat<double>(1) / here.least;
  const V3<double>& sum = here.sum;
  if (any_above(fma(zero, sum.x, fma(zero, sum.y, fma(zero, sum.z, range))), kSafeMost)) {
    double block[3][8] = {};
    add_dashpots_carefully(runs, view, i, kDoubles, block);
    return {load(block[0]), load(block[1]), load(block[2])};
  }
  return here.sum;
}

void add_runs(std::span<const DashpotRun> runs, const ParticleView& view, int begin, int end,
              ForceSink sink) {
  double* const to[3] = {sink.x, sink.y, sink.z};
  for (int i = begin; i < end; i += kDoubles) {
    const V3<double> force = dashpot_block(runs, view, i);
    const Doubles parts[3] = {force.x, force.y, force.z};
    for (int axis = 0; axis < 3; ++axis) {
      if (i + kDoubles <= end) {
        store(to[axis] + i, load(to[axis] + i) + parts[axis]);
      } else {
        for (int lane = 0; i + lane < end; ++lane) to[axis][i + lane] += parts[axis][lane];
      }
    }
  }
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

DashpotForces dashpot_forces() { return SIM_CHOOSE(add_runs); }

}  // namespace sim
#endif
