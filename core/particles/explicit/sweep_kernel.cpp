#include "core/particles/explicit/sweep.h"
#include "core/simd/inverse_sqrt.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/explicit/sweep_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/particles/springs/spring_kernel.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// The sum of the forces on a block, or what it is one spring at a time from `gathered` on.
template <class Real>
SIM_INLINE V3<Real> with_care(std::span<const SweepRun<Real>> runs, std::int64_t turn,
                              const Real* const q[3], int i, const V3<Real>& gathered,
                              V<Real> errors, const V3<Real>& sum) {
  if constexpr (std::is_same_v<Real, float>) {
    return sum;
  } else {
    if (!needs_care(errors, sum)) return sum;
    double block[3][8];
    store(block[0], gathered.x);
    store(block[1], gathered.y);
    store(block[2], gathered.z);
    add_block_carefully(runs, turn, q, i, kDoubles, block);
    return {load(block[0]), load(block[1]), load(block[2])};
  }
}

// The springs of a run that a block owns, the block `turn` of the ring: adds their forces and puts
// their factors, which it returns, into the ring.
template <class Real>
SIM_INLINE V<Real> own_springs(const SweepRun<Real>& run, std::int64_t turn, const Real* const q[3],
                               int i, const V3<Real>& here, V3<Real>& sum, V<Real>& errors) {
  V<Real> s{};
  if (const unsigned bits = block_bits<Real>(run.owners, i)) {
    const V3<Real> d = here - load(q, i + run.stride);
    s = spring_factors(d, Constants<Real>(run, i), bits, errors);
    add_scaled(s, d, sum);
  }
  const std::int64_t to = turn & run.mask;
  store(run.ring + to, s);
  if (to == 0) store(run.ring + run.mask + 1, s);  // once more behind the end
  return s;
}

// The factors of the springs between a block and the particles `stride` before it, which own them;
// `own` are those of the block itself.
template <class Real>
SIM_INLINE V<Real> arriving(const SweepRun<Real>& run, std::int64_t turn, V<Real> own) {
#if SIM_BITS == 512
  // Closer than a vector: from this block and the one before, in registers.
  if (run.stride < kLanes<Real>) {
    const std::int64_t before = turn - kLanes<Real>;
    return lanes_from(kLanes<Real> - static_cast<int>(run.stride),
                      load(run.ring + (before & run.mask)), own);
  }
#else
  (void)own;
#endif
  return load(run.ring + ((turn - run.stride) & run.mask));
}

// The forces of all runs on a block.
template <class Real>
SIM_INLINE V3<Real> block_forces(std::span<const SweepRun<Real>> runs, std::int64_t turn,
                                 const Real* const q[3], int i, const Real* const force[3]) {
  const V3<Real> here = load(q, i);
  V3<Real> sum{};
  if (force[0]) sum = load(force, i);
  const V3<Real> gathered = sum;
  V<Real> errors{};
  for (const SweepRun<Real>& run : runs) {
    const V<Real> own = own_springs(run, turn, q, i, here, sum, errors);
    if (run.stride < i + kBlock<Real>)
      add_scaled(arriving(run, turn, own), here - load(q, i - run.stride), sum);
  }
  return with_care(runs, turn, q, i, gathered, errors, sum);
}

template <class Real>
SIM_INLINE bool all_zero(V<Real> v) {
  Real all = 0;
  for (int lane = 0; lane < kLanes<Real>; ++lane) all += v[lane];
  return all == 0;
}

// sum + row, of N terms known when compiling or, with N = kAny, of as many as the row has.
constexpr int kAny = -1;

template <class Real, int N>
struct RowSum {
  V<Real> coef[N == kAny ? Row<Real>::kMost : N + 1];
  const Row<Real>* row;

  SIM_INLINE explicit RowSum(const Row<Real>& from) : row(&from) {
    const int terms = N == kAny ? from.terms : N;
    for (int j = 0; j < terms; ++j) coef[j] = splat<Real>(from.coef[j]);
  }
  SIM_INLINE V<Real> add_to(V<Real> sum, int axis, int i) const {
    const int terms = N == kAny ? row->terms : N;
    for (int j = 0; j < terms; ++j) sum = fma(coef[j], load(row->a[j][axis] + i), sum);
    return sum;
  }
};

// NowTerms, QTerms and VTerms are the numbers of terms of the three rows of the stage.
template <class Real, int NowTerms, int QTerms, int VTerms>
SIM_INLINE bool rk_blocks(Rings<Real>& rings, const Motion& motion, const RkStage<Real>& stage,
                          int begin, int end) {
  const RowSum<Real, NowTerms> v_now(stage.v_now);
  const RowSum<Real, QTerms> q_row(stage.q_row);
  const RowSum<Real, VTerms> v_row(stage.v_row);
  const V<Real> drift = splat<Real>(stage.drift), kick = splat<Real>(stage.kick);
  const bool damped = motion.damping != 0, last = stage.v_next[0], keep_a = stage.a[0];
  const V<Real> zero{};
  V<Real> check{};
  const std::span<const SweepRun<Real>> runs = rings.runs();
  std::int64_t turn = rings.turn;
  for (int i = begin; i < end; i += kLanes<Real>, turn += kLanes<Real>) {
    const V3<Real> sum = block_forces(runs, turn, stage.q, i, stage.force);
    const V<Real> forces[3] = {sum.x, sum.y, sum.z};
    const unsigned free = block_bits<Real>(motion.free, i);
    const V<Real> inverse_mass = motion.inverse_masses ? load<Real>(motion.inverse_masses + i)
                                                       : splat<Real>(motion.inverse_mass);
    const V<Real> rate = splat<Real>(motion.damping) * inverse_mass;
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis) {
      const V<Real> v0 = load(stage.v0[axis] + i);
      // a = F/m + g - (c/m) v
      V<Real> a = fma(forces[axis], inverse_mass, splat<Real>(motion.gravity[axis]));
      if (damped) a = fma(-rate, v_now.add_to(v0, axis, i), a);
      a = keep(free, a);
      if (keep_a) store(stage.a[axis] + i, a);
      if (stage.q_next[0]) {
        const V<Real> q = q_row.add_to(fma(drift, v0, load(stage.q0[axis] + i)), axis, i);
        store(stage.q_next[axis] + i, q);
        if (last) check += zero * q;
      }
      if (last) {
        const V<Real> v = fma(kick, a, v_row.add_to(v0, axis, i));
        store(stage.v_next[axis] + i, v);
        check += zero * v;
      }
    }
  }
  rings.turn = turn;
  return all_zero<Real>(check);
}

// A stage whose acceleration is known: what follows from it for the next. No method ends with one.
template <class Real>
bool known_blocks(const RkStage<Real>& stage, int begin, int end) {
  const RowSum<Real, kAny> q_row(stage.q_row), v_row(stage.v_row);
  const V<Real> drift = splat<Real>(stage.drift), kick = splat<Real>(stage.kick);
  for (int i = begin; i < end; i += kLanes<Real>)
    for (int axis = 0; axis < 3; ++axis) {
      const V<Real> v0 = load(stage.v0[axis] + i);
      const V<Real> q = fma(drift, v0, load(stage.q0[axis] + i));
      store(stage.q_next[axis] + i, q_row.add_to(q, axis, i));
      if (stage.v_next[0])
        store(stage.v_next[axis] + i,
              fma(kick, load(stage.a[axis] + i), v_row.add_to(v0, axis, i)));
    }
  return true;
}

// The stages of the methods that people use most have loops of their own.
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

// keep v + gain a.
template <class Real, bool kUniform>
struct KickOf {
  const Kick* kick;
  V<Real> keep_v, gain;

  SIM_INLINE explicit KickOf(const Kick& from)
      : kick(&from), keep_v(splat<Real>(from.keep)), gain(splat<Real>(from.gain)) {}
  SIM_INLINE void at(int i) {
    if (kUniform) return;
    keep_v = load<Real>(kick->keeps + i);
    gain = load<Real>(kick->gains + i);
  }
  SIM_INLINE V<Real> operator()(V<Real> v, V<Real> a) const { return fma(gain, a, keep_v * v); }
};

// One kick of a splitting method, and the drift after it.
template <class Real, bool kUniform>
SIM_INLINE bool kick_blocks(Rings<Real>& rings, const Motion& motion, const KickStage<Real>& stage,
                            int begin, int end) {
  const V<Real> drift = splat<Real>(stage.drift);
  KickOf<Real, kUniform> kick(stage.kick), next_kick(stage.next_kick);
  V<Real> inverse_mass = splat<Real>(motion.inverse_mass);
  const std::span<const SweepRun<Real>> runs = rings.runs();
  std::int64_t turn = rings.turn;
  const V<Real> zero{};
  V<Real> check{};
  for (int i = begin; i < end; i += kLanes<Real>, turn += kLanes<Real>) {
    if (!kUniform) inverse_mass = load<Real>(motion.inverse_masses + i);
    const unsigned free = block_bits<Real>(motion.free, i);
    const V3<Real> sum = block_forces(runs, turn, stage.q, i, stage.force);
    const V<Real> forces[3] = {sum.x, sum.y, sum.z};
    kick.at(i);
    if (stage.v_after[0]) next_kick.at(i);
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis) {
      const V<Real> a =
          keep(free, fma(forces[axis], inverse_mass, splat<Real>(motion.gravity[axis])));
      V<Real> v = kick(load(stage.v[axis] + i), a);
      if (stage.v_next[0]) store(stage.v_next[axis] + i, v);
      if (stage.check) check += zero * v;
      if (stage.a[0]) store(stage.a[axis] + i, a);
      if (stage.v_after[0]) {
        v = next_kick(v, a);
        store(stage.v_after[axis] + i, v);
      }
      V<Real> q = load(stage.q[axis] + i);
      if (stage.q_next[0]) {
        q = fma(drift, v, q);
        store(stage.q_next[axis] + i, q);
      }
      if (stage.check) check += zero * q;
    }
  }
  rings.turn = turn;
  return all_zero<Real>(check);
}

// No method ends with a drift alone, so that nothing is checked.
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
void warm_up(Rings<Real>& rings, const Real* const q[3], int begin, int end) {
  for (int i = begin; i < end; i += kLanes<Real>, rings.turn += kLanes<Real>) {
    const V3<Real> here = load(q, i);
    const V3<Real> none{};
    V3<Real> sum = none;
    V<Real> errors{};
    for (const SweepRun<Real>& run : rings.runs())
      own_springs(run, rings.turn, q, i, here, sum, errors);
    with_care(rings.runs(), rings.turn, q, i, none, errors, sum);
  }
}

template <class Real>
constexpr SweepKernels<Real> kSweep{rk_sweep<Real>, kick_sweep<Real>, warm_up<Real>};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

template <class Real>
SweepKernels<Real> sweep_kernels() {
  return for_simd_level(sse2::kSweep<Real>, avx2::kSweep<Real>, avx512::kSweep<Real>);
}

template SweepKernels<double> sweep_kernels();
template SweepKernels<float> sweep_kernels();

}  // namespace sim
#endif
