#include "core/particles/explicit/sweep.h"

#include <algorithm>
#include <bit>

#include "core/simd/inverse_sqrt.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/explicit/sweep_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/particles/explicit/sweep_block.h"
#include "core/particles/springs/spring_kernel.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// Recomputes the sum of a block one spring at a time, for numbers beyond the range of the fast
// path.
template <class Real>
SIM_INLINE void take_care(std::span<const SweepRun<Real>> runs, std::int64_t turn,
                          const Real* const q[3], int i, const Real* const force[3], V<Real> errors,
                          Points<Real>& sum) {
  if constexpr (std::is_same_v<Real, double>) {
    for (int h = 1; h < kVectors; ++h) errors = watched(errors, sum.of[h]);
    if (!needs_care(errors, sum.of[0])) return;
    constexpr int lanes = kBlock<double>;
    double block[3][lanes] = {};
    for (int axis = 0; force[0] && axis < 3; ++axis)
      std::copy_n(force[axis] + i, lanes, block[axis]);
    add_block_carefully(runs, turn, q, i, lanes, block);
    const double* const axes[3] = {block[0], block[1], block[2]};
    for (int h = 0; h < kVectors; ++h) sum.of[h] = load(axes, h * kDoubles);
  }
}

// Evaluates the springs of a run that a block owns, in the lanes whose bit is set: adds their
// forces, and returns their factors. q begins at the block.
template <bool kUniform, class Real>
SIM_INLINE Numbers<Real> evaluate(const SweepRun<Real>& run, const Positions<Real>& q,
                                  std::int64_t i, unsigned bits, const Here<Real>& here,
                                  Points<Real>& sum, V<Real>& errors) {
  Constants<Real> spring(run);
  Numbers<Real> s;
#pragma GCC unroll 4
  for (int h = 0; h < kVectors; ++h) {
    const V3<Real> d = here.at(h) - q.at(run.stride, h);
    if (!kUniform) spring.at(run, i + h * kLanes<Real>, squared(d));
    s.of[h] = spring_factors(d, spring, bits >> h * kLanes<Real>, errors);
    add_scaled(s.of[h], d, sum.of[h]);
  }
  return s;
}

// Does the same for the block `turn` of the ring buffer, and stores the factors there.
template <class Real>
SIM_INLINE Numbers<Real> own_springs(const SweepRun<Real>& run, std::int64_t turn,
                                     const Positions<Real>& q, std::int64_t i,
                                     const Here<Real>& here, Points<Real>& sum, V<Real>& errors) {
  Numbers<Real> s{};
  const unsigned bits = block_bits<Real, kVectors>(run.owners, i);
  // No mask is needed if all lanes own a spring; masks are free in some instruction sets.
  if (SIM_BITS < 512 && bits == run.whole) [[likely]]
    s = evaluate<true>(run, q, i, kAllOwn<Real>, here, sum, errors);
  else if (bits)
    s = evaluate<false>(run, q, i, bits, here, sum, errors);
  const std::int64_t to = turn & run.mask;
  Real* const ring = run.ring;
  store_block(ring + to, s);
  if (to == 0) store_block(ring + run.mask + 1, s);  // once more behind the end
  return s;
}

// The factors of the springs between a block and the particles `stride` before it, which own them;
// `own` are the factors of the block itself.
template <class Real>
SIM_INLINE Numbers<Real> arriving(const SweepRun<Real>& run, std::int64_t turn,
                                  [[maybe_unused]] const Numbers<Real>& own) {
#if SIM_BITS == 512
  // A stride shorter than a vector takes factors from this block and the one before, in registers.
  if (run.stride < kLanes<Real>) {
    const std::int64_t before = turn - kLanes<Real>;
    return {lanes_from(kLanes<Real> - static_cast<int>(run.stride),
                       load(run.ring + (before & run.mask)), own.of[0])};
  }
#endif
  return load_block(run.ring + ((turn + run.back) & run.mask));
}

// The larger part of each loop over blocks. Without fused multiply-add it is so long that a call is
// cheap, and inlining it into each loop would cost much compile time.
#if SIM_FMA
#define SIM_BLOCK_FORCES SIM_INLINE
#else
#define SIM_BLOCK_FORCES __attribute__((noinline))
#endif

// The forces of all runs on a block.
template <class Real>
SIM_BLOCK_FORCES Points<Real> block_forces(std::span<const SweepRun<Real>> runs, std::int64_t turn,
                                           const Real* const positions[3], int i,
                                           const Real* const force[3]) {
  const Positions<Real> q(positions, i);
  const Here<Real> here(q);
  Points<Real> sum{};
  if (force[0]) sum = Positions<Real>(force).block(i);
  V<Real> errors{};
  for (const SweepRun<Real>& run : runs) {
    const Numbers<Real> own = own_springs(run, turn, q, i, here, sum, errors);
    if (run.stride >= i + kBlock<Real>) continue;
    const Numbers<Real> s = arriving(run, turn, own);
    const std::int64_t back = run.back;
#pragma GCC unroll 4
    for (int h = 0; h < kVectors; ++h) add_scaled(s.of[h], here.at(h) - q.at(back, h), sum.of[h]);
  }
  take_care(runs, turn, positions, i, force, errors, sum);
  return sum;
}

template <class Real>
SIM_INLINE bool all_zero(V<Real> v) {
  Real all = 0;
  for (int lane = 0; lane < kLanes<Real>; ++lane) all += v[lane];
  return all == 0;
}

// sum + row, of N terms known at compile time or, with N = kAny, of as many as the row has.
constexpr int kAny = -1;

template <class Real, int N>
struct RowSum {
  V<Real> coef[N == kAny ? Row<Real>::kMost : N + 1];
  const Row<Real>* row;

  SIM_INLINE explicit RowSum(const Row<Real>& from) : row(&from) {
    const int terms = N == kAny ? from.terms : N;
    for (int j = 0; j < terms; ++j) coef[j] = splat<Real>(from.coef[j]);
  }
  SIM_INLINE Numbers<Real> add_to(Numbers<Real> sum, int axis, int i) const {
    const int terms = N == kAny ? row->terms : N;
    for (int j = 0; j < terms; ++j) {
      const Numbers<Real> a = load_block(row->a[j][axis] + i);
      for (int h = 0; h < kVectors; ++h) sum.of[h] = fma(coef[j], a.of[h], sum.of[h]);
    }
    return sum;
  }
};

template <class Real>
SIM_INLINE V<Real> part(const V3<Real>& v, int axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

// 1/m and -c/m of a block.
template <class Real>
struct Weights {
  Numbers<Real> inverse_mass, minus_rate;

  SIM_INLINE Weights(const Motion& motion, int i) {
    for (int h = 0; h < kVectors; ++h) {
      inverse_mass.of[h] = motion.inverse_masses
                               ? load<Real>(motion.inverse_masses + i + h * kLanes<Real>)
                               : splat<Real>(motion.inverse_mass);
      minus_rate.of[h] = -(splat<Real>(motion.damping) * inverse_mass.of[h]);
    }
  }
};

// Sets the velocities of pinned particles to 0, on all axes.
template <class Real>
SIM_INLINE void keep_free(unsigned free, Numbers<Real> (&v)[3]) {
  if (kVectors > 1 && free == kAllOwn<Real>) return;
  for (int axis = 0; axis < 3; ++axis)
    for (int h = 0; h < kVectors; ++h)
      v[axis].of[h] = keep(free >> h * kLanes<Real>, v[axis].of[h]);
}

template <class Real>
SIM_INLINE void store_all(Real* const to[3], int i, const Numbers<Real> (&v)[3]) {
  for (int axis = 0; axis < 3; ++axis) store_block(to[axis] + i, v[axis]);
}

// check += 0 v, which is not a number if some v is not finite.
template <class Real>
SIM_INLINE void add_zeros(const Numbers<Real>& v, V<Real>& check) {
  const V<Real> zero{};
  for (const V<Real>& each : v.of) check = SIM_FMA ? fma(zero, each, check) : check + zero * each;
}

// NowTerms, QTerms and VTerms are the numbers of terms of the three rows of the stage.
template <class Real, int NowTerms, int QTerms, int VTerms>
SIM_INLINE bool rk_blocks(Rings<Real>& rings, const Motion& motion, const RkStage<Real>& stage,
                          int begin, int end) {
  const RowSum<Real, NowTerms> v_now(stage.v_now);
  const RowSum<Real, QTerms> q_row(stage.q_row);
  const RowSum<Real, VTerms> v_row(stage.v_row);
  const V<Real> drift = splat<Real>(stage.drift), kick = splat<Real>(stage.kick);
  // Testing the bits is cheaper than comparing the number.
  const bool damped = std::bit_cast<std::uint64_t>(motion.damping) != 0;
  const bool last = stage.v_next[0], keep_a = stage.a[0];
  V<Real> check{};
  const std::span<const SweepRun<Real>> runs = rings.runs();
  std::int64_t turn = rings.turn;
  for (int i = begin; i < end; i += kBlock<Real>, turn += kBlock<Real>) {
    const Points<Real> force = block_forces(runs, turn, stage.q, i, stage.force);
    const unsigned free = block_bits<Real, kVectors>(motion.free, i);
    const Weights<Real> weights(motion, i);
    // a = F/m + g - (c/m) v on all axes, so that each condition is tested once.
    Numbers<Real> a[3];
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis)
      for (int h = 0; h < kVectors; ++h)
        a[axis].of[h] = fma(part(force.of[h], axis), weights.inverse_mass.of[h],
                            splat<Real>(motion.gravity[axis]));
    if (damped) {
#pragma GCC unroll 3
      for (int axis = 0; axis < 3; ++axis) {
        const Numbers<Real> v = v_now.add_to(load_block(stage.v0[axis] + i), axis, i);
        for (int h = 0; h < kVectors; ++h)
          a[axis].of[h] = fma(weights.minus_rate.of[h], v.of[h], a[axis].of[h]);
      }
    }
    keep_free(free, a);
    if (keep_a) store_all(stage.a, i, a);
    if (stage.q_next[0]) {
#pragma GCC unroll 3
      for (int axis = 0; axis < 3; ++axis) {
        const Numbers<Real> v0 = load_block(stage.v0[axis] + i);
        Numbers<Real> q = load_block(stage.q0[axis] + i);
        for (int h = 0; h < kVectors; ++h) q.of[h] = fma(drift, v0.of[h], q.of[h]);
        store_block(stage.q_next[axis] + i, q_row.add_to(q, axis, i));
      }
    }
    if (last) {
#pragma GCC unroll 3
      for (int axis = 0; axis < 3; ++axis) {
        if (stage.q_next[0]) add_zeros(load_block(stage.q_next[axis] + i), check);
        Numbers<Real> v = v_row.add_to(load_block(stage.v0[axis] + i), axis, i);
        for (int h = 0; h < kVectors; ++h) v.of[h] = fma(kick, a[axis].of[h], v.of[h]);
        store_block(stage.v_next[axis] + i, v);
        add_zeros(v, check);
      }
    }
  }
  rings.turn = turn;
  return all_zero<Real>(check);
}

// A stage whose acceleration is known computes only the input of the next. No method ends with one.
template <class Real>
bool known_blocks(const RkStage<Real>& stage, int begin, int end) {
  const RowSum<Real, kAny> q_row(stage.q_row), v_row(stage.v_row);
  const V<Real> drift = splat<Real>(stage.drift), kick = splat<Real>(stage.kick);
  for (int i = begin; i < end; i += kBlock<Real>)
    for (int axis = 0; axis < 3; ++axis) {
      const Numbers<Real> v0 = load_block(stage.v0[axis] + i), a = load_block(stage.a[axis] + i);
      Numbers<Real> q = load_block(stage.q0[axis] + i), v = v_row.add_to(v0, axis, i);
      for (int h = 0; h < kVectors; ++h) {
        q.of[h] = fma(drift, v0.of[h], q.of[h]);
        v.of[h] = fma(kick, a.of[h], v.of[h]);
      }
      store_block(stage.q_next[axis] + i, q_row.add_to(q, axis, i));
      if (stage.v_next[0]) store_block(stage.v_next[axis] + i, v);
    }
  return true;
}

// The stages of the most frequently used methods have loops of their own.
template <class Real>
bool rk_sweep(Rings<Real>& rings, const Motion& motion, const RkStage<Real>& stage, int begin,
              int end) {
  if (!stage.q[0]) return known_blocks(stage, begin, end);
  const int now = stage.v_now.terms, q = stage.q_row.terms;
  const int v = stage.v_next[0] ? stage.v_row.terms : 0;
  if (now == 0 && q == 0 && v == 0)
    return rk_blocks<Real, 0, 0, 0>(rings, motion, stage, begin, end);
  if (now == 1 && q == 0 && v == 0)
    return rk_blocks<Real, 1, 0, 0>(rings, motion, stage, begin, end);
  if (now == 1 && q == 1 && v == 0)
    return rk_blocks<Real, 1, 1, 0>(rings, motion, stage, begin, end);
  if (now == 1 && q == 1 && v == 1)
    return rk_blocks<Real, 1, 1, 1>(rings, motion, stage, begin, end);
  if (now == 1 && q == 3 && v == 3)
    return rk_blocks<Real, 1, 3, 3>(rings, motion, stage, begin, end);
  return rk_blocks<Real, kAny, kAny, kAny>(rings, motion, stage, begin, end);
}

// Computes keep v + gain a for a block.
template <class Real, bool kUniform>
struct KickOf {
  const Kick* kick;
  V<Real> keep_v, gain;

  SIM_INLINE explicit KickOf(const Kick& from)
      : kick(&from), keep_v(splat<Real>(from.keep)), gain(splat<Real>(from.gain)) {}
  SIM_INLINE void apply(Numbers<Real>& v, const Numbers<Real>& a, int i) {
    for (int h = 0; h < kVectors; ++h) {
      if (!kUniform) {
        keep_v = load<Real>(kick->keeps + i + h * kLanes<Real>);
        gain = load<Real>(kick->gains + i + h * kLanes<Real>);
      }
      v.of[h] = fma(gain, a.of[h], keep_v * v.of[h]);
    }
  }
};

// One kick of a splitting method and the drift after it.
template <class Real, bool kUniform>
SIM_INLINE bool kick_blocks(Rings<Real>& rings, const Motion& motion, const KickStage<Real>& stage,
                            int begin, int end) {
  const V<Real> drift = splat<Real>(stage.drift);
  KickOf<Real, kUniform> kick(stage.kick), next_kick(stage.next_kick);
  V<Real> inverse_mass = splat<Real>(motion.inverse_mass);
  const std::span<const SweepRun<Real>> runs = rings.runs();
  std::int64_t turn = rings.turn;
  V<Real> check{};
  for (int i = begin; i < end; i += kBlock<Real>, turn += kBlock<Real>) {
    const unsigned free = block_bits<Real, kVectors>(motion.free, i);
    const Points<Real> force = block_forces(runs, turn, stage.q, i, stage.force);
    Numbers<Real> a[3], v[3];
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis)
      for (int h = 0; h < kVectors; ++h) {
        if (!kUniform) inverse_mass = load<Real>(motion.inverse_masses + i + h * kLanes<Real>);
        a[axis].of[h] =
            fma(part(force.of[h], axis), inverse_mass, splat<Real>(motion.gravity[axis]));
      }
    keep_free(free, a);
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis) {
      v[axis] = load_block(stage.v[axis] + i);
      kick.apply(v[axis], a[axis], i);
      if (stage.check) add_zeros(v[axis], check);
    }
    if (stage.v_next[0]) store_all(stage.v_next, i, v);
    if (stage.a[0]) store_all(stage.a, i, a);
    if (stage.v_after[0]) {
#pragma GCC unroll 3
      for (int axis = 0; axis < 3; ++axis) next_kick.apply(v[axis], a[axis], i);
      store_all(stage.v_after, i, v);
    }
    if (stage.q_next[0] || stage.check) {
#pragma GCC unroll 3
      for (int axis = 0; axis < 3; ++axis) {
        Numbers<Real> q = load_block(stage.q[axis] + i);
        if (stage.q_next[0]) {
          for (int h = 0; h < kVectors; ++h) q.of[h] = fma(drift, v[axis].of[h], q.of[h]);
          store_block(stage.q_next[axis] + i, q);
        }
        if (stage.check) add_zeros(q, check);
      }
    }
  }
  rings.turn = turn;
  return all_zero<Real>(check);
}

// No method ends with a drift alone, so that finiteness is not checked here.
template <class Real>
bool drift_blocks(const KickStage<Real>& stage, int begin, int end) {
  const V<Real> drift = splat<Real>(stage.drift);
  for (int i = begin; i < end; i += kLanes<Real>)
    for (int axis = 0; axis < 3; ++axis)
      store(stage.q_next[axis] + i, fma(drift, load(stage.v[axis] + i), load(stage.q[axis] + i)));
  return true;
}

template <class Real>
bool kick_sweep(Rings<Real>& rings, const Motion& motion, const KickStage<Real>& stage, int begin,
                int end) {
  if (!stage.kicks) return drift_blocks(stage, begin, end);
  return stage.kick.keeps ? kick_blocks<Real, false>(rings, motion, stage, begin, end)
                          : kick_blocks<Real, true>(rings, motion, stage, begin, end);
}

template <class Real>
void warm_up(Rings<Real>& rings, const Real* const positions[3], int begin, int end) {
  const Real* const none[3] = {};
  for (int i = begin; i < end; i += kBlock<Real>, rings.turn += kBlock<Real>) {
    const Positions<Real> q(positions, i);
    const Here<Real> here(q);
    Points<Real> sum{};
    V<Real> errors{};
    for (const SweepRun<Real>& run : rings.runs())
      own_springs(run, rings.turn, q, i, here, sum, errors);
    take_care(rings.runs(), rings.turn, positions, i, none, errors, sum);
  }
}

template <class Real>
constexpr SweepKernels<Real> kSweep{rk_sweep<Real>, kick_sweep<Real>, warm_up<Real>};

#undef SIM_BLOCK_FORCES
}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

template <class Real>
SweepKernels<Real> sweep_kernels() {
  return SIM_CHOOSE(kSweep<Real>);
}

template SweepKernels<double> sweep_kernels();
template SweepKernels<float> sweep_kernels();

}  // namespace sim
#endif
