// The use that a method makes of each acceleration of a sweep, as data. Arrays are named by three
// pointers, one an axis, and indexed by particle id. Their numbers are Real, double or float; all
// constants are doubles.
#pragma once

namespace sim {

// sum_j coef_j a_j over earlier accelerations a_j.
template <class Real>
struct Row {
  static constexpr int kMost = 16;
  int terms = 0;
  double coef[kMost];
  const Real* a[kMost][3];

  void add(double c, const Real* const from[3]) {
    coef[terms] = c;
    for (int axis = 0; axis < 3; ++axis) a[terms][axis] = from[axis];
    ++terms;
  }
};

// One stage of a Runge-Kutta method on particles: a = the acceleration at the positions q and the
// velocity v0 + v_now, and from it the positions of the next stage and the final velocity.
template <class Real>
struct RkStage {
  const Real* q[3];   // positions of this stage, or null where `a` is known already
  const Real* q0[3];  // at the start of the step
  const Real* v0[3];
  const Real* force[3];  // forces gathered before, or null
  Row<Real> v_now;
  Real* a[3];       // kept for later rows, or null
  Real* q_next[3];  // := q0 + drift v0 + row, or null
  double drift;
  Row<Real> q_row;
  Real* v_next[3];  // := v0 + row + kick a, or null
  double kick;
  Row<Real> v_row;
};

// v := keep v + gain a.
struct Kick {
  double keep, gain;            // when all masses are the same
  const double *keeps, *gains;  // of each particle, otherwise
};

// One kick of a splitting method and the drift after it, or a drift alone:
//   v_next = kick(v, a),  v_after = next_kick(v_next, a),  q_next = q + drift (v_after or v_next)
template <class Real>
struct KickStage {
  const Real* q[3];
  const Real* v[3];
  const Real* force[3];  // forces gathered before, or null
  bool kicks;            // or a drift alone
  Kick kick;
  Real* v_next[3];  // may be v; null where nobody looks
  Kick next_kick;
  Real* v_after[3];  // the first kick of the step after, or null
  Real* a[3];        // the acceleration, or null
  double drift;
  Real* q_next[3];  // or null
  bool check;       // look for numbers that are not finite in the positions and v_next
};

}  // namespace sim
